// SPDX-License-Identifier: Apache-2.0
// 8-bit pictures to JPEG by libjpeg-turbo. Comes after Film and toSrgb8; goes to frames and responses.
#pragma once
#include <cstdint>
#include <vector>

#include "renderer/data/image.h"

namespace scolopax::server {

enum class ChromaSampling { full444, half420 };

/// Memory that encoding a picture of so many pixels takes, its 8-bit form included.
std::uint64_t jpegMemory(std::uint64_t pixels);

/// JPEG bytes (JFIF, sRGB values as given). `quality` in [1,100]. The same picture gives the same bytes.
/// Throws Error(badInput) for an empty picture and Error(tooLarge) for one JPEG cannot hold (65500 a side).
std::vector<std::uint8_t> encodeJpeg(const Image8& image, int quality, ChromaSampling sampling);

}  // namespace scolopax::server
