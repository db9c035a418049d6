// SPDX-License-Identifier: Apache-2.0
// RLE of colours with 16 bits (dicom.nema.org, PS3.5 annex G), whose bytes GDCM 3.0 puts in a wrong order.
#include "renderer/io/dicom_rle.h"

#if SCOLOPAX_HAS_GDCM
#include <cstdint>
#include <cstring>

#include "renderer/core/error.h"

namespace scolopax::io {
namespace {

[[noreturn]] void failRle() {
  throw Error(ErrorCode::badInput, "expected RLE data of a whole frame, found damaged ones");
}

/// Unpacks one segment (PackBits) to every `stride`-th byte.
void unpackRleSegment(std::span<const std::byte> packed, std::byte* out, std::size_t count,
                      std::size_t stride) {
  std::size_t at = 0, done = 0;
  while (done < count) {
    if (at >= packed.size()) failRle();
    const int code = std::to_integer<int>(packed[at++]);
    if (code == 128) continue;
    const bool repeated = code > 128;
    const std::size_t length = std::size_t(repeated ? 257 - code : code + 1), stored = repeated ? 1 : length;
    if (length > count - done || stored > packed.size() - at) failRle();
    for (std::size_t i = 0; i < length; ++i) out[(done + i) * stride] = packed[at + (repeated ? 0 : i)];
    done += length;
    at += stored;
  }
}

}  // namespace

void decodeRleFrame(std::span<const std::byte> packed, std::size_t pixels, std::size_t samples,
                    std::size_t sampleBytes, std::byte* out) {
  constexpr std::size_t kHeaderNumbers = 16;
  std::uint32_t header[kHeaderNumbers];  // the number of segments, and where they begin
  const std::size_t segments = samples * sampleBytes;
  if (packed.size() < sizeof header) failRle();
  std::memcpy(header, packed.data(), sizeof header);
  if (header[0] != segments || segments >= kHeaderNumbers) failRle();
  for (std::size_t segment = 0; segment < segments; ++segment) {
    const std::size_t first = header[1 + segment];
    if (first > packed.size()) failRle();
    // The most significant byte of a sample comes first.
    const std::size_t sample = segment / sampleBytes, byte = sampleBytes - 1 - segment % sampleBytes;
    unpackRleSegment(packed.subspan(first), out + sample * sampleBytes + byte, pixels, samples * sampleBytes);
  }
}

}  // namespace scolopax::io
#endif
