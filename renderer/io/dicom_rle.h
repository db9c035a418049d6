// SPDX-License-Identifier: Apache-2.0
// Between dicom_pixels.cpp and the fragments of a file.
#pragma once
#include <cstddef>
#include <span>

namespace scolopax::io {

/// Decodes one frame of DICOM's RLE to interleaved little-endian samples; `out` has room for them. Throws
/// Error(badInput), without a name of the file, if the data are damaged.
void decodeRleFrame(std::span<const std::byte> packed, std::size_t pixels, std::size_t samples,
                    std::size_t sampleBytes, std::byte* out);

}  // namespace scolopax::io
