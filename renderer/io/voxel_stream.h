// SPDX-License-Identifier: Apache-2.0
// Voxels that lie in a stream one after the other, as after most simple headers. Between ByteStream and the
// readers of such formats.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "renderer/io/byte_stream.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// How voxels lie in a file.
struct VoxelLayout {
  StoredType type = StoredType::u8;
  bool bigEndian = false;
  glm::ivec3 dims{1};
  std::size_t samples = 1;     ///< numbers per voxel; samples 0, 1, ... are channels 0, 1, ..., or times
  bool interleaved = false;    ///< samples vary fastest; otherwise each is a whole volume
  std::uint64_t gapBytes = 0;  ///< skipped between volumes of samples

  std::uint64_t voxelCount() const;
  /// From the first byte to the last one, gaps included; saturates.
  std::uint64_t sizeBytes() const;
  /// "13x7x3 uint16", with the number of samples if there are several.
  std::string description() const;
};

/// Dims from a header's numbers. `where` is file and field. Throws Error(badInput) unless each is at least 1,
/// Error(tooLarge) if one is beyond kMaxVolumeSide or their product beyond 2^48.
glm::ivec3 checkedDims(const std::string& where, std::int64_t x, std::int64_t y, std::int64_t z);

/// Throws Error(badInput) if the file is too short for a `layout` that starts `offset` bytes into the stream,
/// even if its gzip data expand as far as deflate can. Allocates and reads nothing.
void checkFileHolds(const ByteStream& stream, const VoxelLayout& layout, std::uint64_t offset);

/// Reads one volume whose samples vary fastest, from the stream's position on: samples[i] with writers[i].
/// `Stream::read(std::span<std::byte>)` fills the span.
template <class Stream>
void readInterleaved(Stream& stream, const VoxelLayout& layout, const std::vector<std::size_t>& samples,
                     std::span<ChannelWriter> writers) {
  constexpr std::size_t kBytesAtOnce = 1 << 20;
  const std::size_t numberBytes = sizeBytes(layout.type), voxelBytes = numberBytes * layout.samples,
                    count = std::size_t(layout.voxelCount());
  const std::size_t atOnce = std::max<std::size_t>(kBytesAtOnce / voxelBytes, 1);
  std::vector<std::byte> block(std::min(count, atOnce) * voxelBytes);
  for (std::size_t first = 0; first < count; first += atOnce) {
    const std::size_t voxels = std::min(atOnce, count - first);
    stream.read(std::span(block).first(voxels * voxelBytes));
    for (std::size_t i = 0; i < samples.size(); ++i)
      writers[i].writeStrided(first, voxels, block.data() + samples[i] * numberBytes,
                              std::ptrdiff_t(voxelBytes), layout.bigEndian);
  }
}

/// Skips to `offset` of the stream and writes the samples with these indices: samples[i] with writers[i].
void readSamples(ByteStream& stream, std::uint64_t offset, const VoxelLayout& layout,
                 const std::vector<std::size_t>& samples, std::vector<ChannelWriter>& writers);

}  // namespace scolopax::io
