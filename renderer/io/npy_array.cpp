// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/npy_array.h"

#include <algorithm>

#include "renderer/core/error.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kNpyBytesAtOnce = 1 << 20;

/// Calls take(first, count, bytes) for the consecutive voxels of a volume.
template <class Take>
void readInOrder(NpySource& source, std::size_t count, std::size_t voxelBytes, Take&& take) {
  const std::size_t atOnce = std::max<std::size_t>(kNpyBytesAtOnce / voxelBytes, 1);
  std::vector<std::byte> block(std::min(count, atOnce) * voxelBytes);
  for (std::size_t first = 0; first < count; first += atOnce) {
    const std::size_t some = std::min(atOnce, count - first);
    source.read(std::span(block).first(some * voxelBytes));
    take(first, some, block.data());
  }
}

/// Reads the volume at the source's position: `samples` of each voxel, whose numbers lie side by side.
void readNpyVolume(const std::string& where, const NpyArray& array, NpySource& source,
                   const std::vector<std::size_t>& samples, std::span<ChannelWriter> writers,
                   const Loading& loading) {
  const VoxelLayout& layout = array.layout;
  const std::size_t numberBytes = sizeBytes(layout.type),
                    voxelBytes = numberBytes * (layout.interleaved ? layout.samples : 1);
  if (!array.fortranOrder) {
    readInOrder(source, std::size_t(layout.voxelCount()), voxelBytes,
                [&](std::size_t first, std::size_t count, const std::byte* bytes) {
                  for (std::size_t i = 0; i < samples.size(); ++i)
                    writers[i].writeStrided(first, count, bytes + samples[i] * numberBytes,
                                            std::ptrdiff_t(voxelBytes), layout.bigEndian);
                });
    return;
  }
  // In Fortran's order the planes across x follow each other.
  const glm::ivec3 dims = layout.dims;
  const std::size_t planeBytes = std::size_t(dims.y) * std::size_t(dims.z) * voxelBytes;
  loading.checkMemory(where + ": planes of an array in Fortran's order",
                      std::max(planeBytes, kNpyBytesAtOnce));
  const std::array<std::ptrdiff_t, 3> strides{std::ptrdiff_t(planeBytes),
                                              std::ptrdiff_t(std::size_t(dims.z) * voxelBytes),
                                              std::ptrdiff_t(voxelBytes)};
  readInOrder(source, std::size_t(dims.x), planeBytes,
              [&](std::size_t first, std::size_t count, const std::byte* bytes) {
                for (std::size_t i = 0; i < samples.size(); ++i)
                  writers[i].writeBox({int(first), 0, 0}, {int(count), dims.y, dims.z},
                                      bytes + samples[i] * numberBytes, strides, layout.bigEndian);
              });
}

}  // namespace

NpyArray arrangeNpy(const std::string& where, const NpyHeader& header, FourthAxis fourthAxis) {
  constexpr std::int64_t kMostNpyChannels = 4096, kMostNpyTimes = 1 << 24;
  std::vector<std::int64_t> shape = header.shape;
  if (shape.empty() || shape.size() > 4)
    throw Error(ErrorCode::unsupported,
                where + ": shape: expected 1 to 4 axes, found " + std::to_string(shape.size()));
  NpyArray array{.fortranOrder = header.fortranOrder, .dataOffset = header.dataOffset};
  if (shape.size() == 4) {
    const bool last = shape[3] == 3 && shape[0] != 3;
    const auto fourth = last ? shape.end() - 1 : shape.begin();
    const std::int64_t size = *fourth;
    shape.erase(fourth);
    array.samplesAreTimes = fourthAxis == FourthAxis::automatic ? size != 3 : fourthAxis == FourthAxis::time;
    array.layout.interleaved = last != header.fortranOrder;
    const std::int64_t most =
        array.layout.interleaved || !array.samplesAreTimes ? kMostNpyChannels : kMostNpyTimes;
    if (size < 1 || size > most)
      throw Error(size < 1 ? ErrorCode::badInput : ErrorCode::unsupported,
                  where + ": shape: expected 1 to " + std::to_string(most) +
                      " along the fourth axis, found " + std::to_string(size));
    array.layout.samples = std::size_t(size);
  }
  shape.insert(shape.begin(), 3 - shape.size(), 1);
  array.layout.dims = checkedDims(where + ": shape", shape[2], shape[1], shape[0]);
  array.layout.type = header.type;
  array.layout.bigEndian = header.bigEndian;
  return array;
}

VolumeInfo npyVolume(const NpyArray& array) {
  const std::size_t samples = array.layout.samples;
  return {.levels = {Grid{array.layout.dims}},
          .times = {.count = array.samplesAreTimes ? samples : 1},
          .channels = std::vector<ChannelInfo>(array.samplesAreTimes ? 1 : samples,
                                               ChannelInfo{.type = array.layout.type})};
}

std::vector<VoxelBuffer> readNpyVoxels(const std::string& where, const NpyArray& array, NpySource& source,
                                       const VolumeInfo& volume, const Part& part, Loading& loading) {
  auto writers = makeWriters(where, volume, part, loading);
  const auto samples = array.samplesAreTimes ? std::vector{part.time} : part.channels;
  source.skip(array.dataOffset);
  if (array.layout.interleaved) {
    readNpyVolume(where, array, source, samples, writers, loading);
    return takeAll(writers);
  }
  const std::uint64_t volumeBytes = array.layout.voxelCount() * sizeBytes(array.layout.type);
  std::size_t next = 0;  // the sample at the source's position
  for (std::size_t i = 0; i < samples.size(); ++i) {
    source.skip((samples[i] - next) * volumeBytes);
    readNpyVolume(where, array, source, {0}, std::span(writers).subspan(i, 1), loading);
    next = samples[i] + 1;
  }
  return takeAll(writers);
}

}  // namespace scolopax::io
