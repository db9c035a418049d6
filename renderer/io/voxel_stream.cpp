// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/voxel_stream.h"

#include <algorithm>
#include <numeric>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kBytesAtOnce = 1 << 20;

/// Volumes one after the other, of which the chosen ones are read in the order of the file.
void readPlanar(ByteStream& stream, const VoxelLayout& layout, const std::vector<std::size_t>& samples,
                std::vector<ChannelWriter>& writers) {
  const std::size_t numberBytes = sizeBytes(layout.type), count = std::size_t(layout.voxelCount());
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::ranges::sort(order, {}, [&](std::size_t i) { return samples[i]; });
  const std::uint64_t start = stream.position(), step = count * numberBytes + layout.gapBytes;
  std::vector<std::byte> block(std::min(count * numberBytes, kBytesAtOnce));
  for (const std::size_t i : order) {
    stream.skip(start + samples[i] * step - stream.position());
    for (std::size_t first = 0; first < count; first += kBytesAtOnce / numberBytes) {
      const auto some =
          std::span(block).first(std::min(kBytesAtOnce / numberBytes, count - first) * numberBytes);
      stream.read(some);
      writers[i].write(first, some, layout.bigEndian);
    }
  }
}

}  // namespace

std::uint64_t VoxelLayout::voxelCount() const {
  return std::uint64_t(dims.x) * std::uint64_t(dims.y) * std::uint64_t(dims.z);
}

std::uint64_t VoxelLayout::sizeBytes() const {
  const std::uint64_t voxels =
      saturatingProduct(voxelCount(), saturatingProduct(std::uint64_t(samples), io::sizeBytes(type)));
  return saturatingSum(voxels, saturatingProduct(gapBytes, std::uint64_t(samples) - 1));
}

std::string VoxelLayout::description() const {
  std::string text = std::to_string(dims.x) + "x" + std::to_string(dims.y) + "x" + std::to_string(dims.z) +
                     " " + std::string(nameOf(type));
  if (samples > 1) text += " of " + std::to_string(samples) + " samples";
  return text;
}

glm::ivec3 checkedDims(const std::string& where, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::string found =
      "found " + std::to_string(x) + " x " + std::to_string(y) + " x " + std::to_string(z);
  if (x < 1 || y < 1 || z < 1)
    throw Error(ErrorCode::badInput, where + ": expected sizes of at least 1, " + found);
  const bool fits = x <= kMaxVolumeSide && y <= kMaxVolumeSide && z <= kMaxVolumeSide &&
                    saturatingProduct(std::uint64_t(x) * std::uint64_t(y), std::uint64_t(z)) <= 1ull << 48;
  if (!fits)
    throw Error(ErrorCode::tooLarge,
                where + ": expected at most 2^48 voxels and 2^24 along an axis, " + found);
  return glm::ivec3(int(x), int(y), int(z));
}

void checkFileHolds(const ByteStream& stream, const VoxelLayout& layout, std::uint64_t offset) {
  const std::uint64_t needed = saturatingSum(offset, layout.sizeBytes());
  if (needed <= stream.largestSize()) return;
  throw Error(ErrorCode::badInput, shown(stream.path()) + ": " + layout.description() + " at byte " +
                                       std::to_string(offset) + " needs " + byteCount(needed) +
                                       ", the file holds " + (stream.compressed() ? "at most " : "") +
                                       byteCount(stream.largestSize()));
}

void readSamples(ByteStream& stream, std::uint64_t offset, const VoxelLayout& layout,
                 const std::vector<std::size_t>& samples, std::vector<ChannelWriter>& writers) {
  checkFileHolds(stream, layout, offset);
  stream.skip(offset - stream.position());
  if (layout.interleaved && layout.samples > 1)
    readInterleaved(stream, layout, samples, writers);
  else
    readPlanar(stream, layout, samples, writers);
}

}  // namespace scolopax::io
