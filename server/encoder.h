// SPDX-License-Identifier: Apache-2.0
// Encodes 8-bit pictures as JPEG with libjpeg-turbo, after Film and toSrgb8, for frames and responses.
#pragma once
#include <cstdint>
#include <vector>

#include "renderer/data/image.h"

namespace scolopax::server {

enum class ChromaSampling { full444, half420 };

/// Bytes of memory for encoding a picture of `pixels` pixels, including the 8-bit picture.
std::uint64_t jpegMemory(std::uint64_t pixels);

/// A JPEG file (JFIF, sRGB values as given). `quality` is in [1, 100]. The same picture always gives the same
/// bytes. Throws Error: badInput for an empty picture, tooLarge for more than 65500 pixels on a side, which
/// JPEG does not support.
std::vector<std::uint8_t> encodeJpeg(const Image8& image, int quality, ChromaSampling sampling);

}  // namespace scolopax::server
