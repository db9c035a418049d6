// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/volume_file.h"

#include <algorithm>
#include <numeric>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

std::vector<std::size_t> orAll(const std::vector<std::size_t>& channels, const VolumeInfo& volume) {
  if (!channels.empty()) return channels;
  std::vector<std::size_t> all(volume.channels.size());
  std::iota(all.begin(), all.end(), std::size_t(0));
  return all;
}

/// Bytes of a level, with `bytesOf` each voxel of a channel.
template <class BytesOf>
std::uint64_t sumOverChannels(const VolumeInfo& volume, std::size_t level,
                              const std::vector<std::size_t>& channels, BytesOf&& bytesOf) {
  std::uint64_t perVoxel = 0;
  for (const std::size_t channel : orAll(channels, volume))
    perVoxel += bytesOf(volume.channels[channel].type);
  return saturatingProduct(volume.levels[level].voxelCount(), perVoxel);
}

void checkIndex(const std::string& file, const char* what, std::size_t index, std::size_t count) {
  if (index < count) return;
  throw Error(ErrorCode::badInput, file + ": " + what + ": expected 0 to " + std::to_string(count - 1) +
                                       ", found " + std::to_string(index));
}

}  // namespace

std::vector<ChannelWriter> makeWriters(const std::string& file, const VolumeInfo& volume, const Part& part,
                                       Loading& loading) {
  std::vector<ChannelWriter> writers;
  for (const std::size_t channel : part.channels)
    writers.emplace_back(file, volume.channels[channel].type, volume.levels[part.level].dims, loading);
  return writers;
}

std::uint64_t memoryBytes(const VolumeInfo& volume, std::size_t level,
                          const std::vector<std::size_t>& channels) {
  return sumOverChannels(volume, level, channels,
                         [](StoredType type) { return scolopax::sizeBytes(largestKeptType(type)); });
}

std::uint64_t storedBytes(const VolumeInfo& volume, std::size_t level,
                          const std::vector<std::size_t>& channels) {
  if (volume.readBytes) return volume.readBytes(level, orAll(channels, volume));
  return sumOverChannels(volume, level, channels, [](StoredType type) { return sizeBytes(type); });
}

std::string description(const VolumeInfo& volume, std::size_t level,
                        const std::vector<std::size_t>& channels) {
  const glm::ivec3& dims = volume.levels[level].dims;
  const auto chosen = orAll(channels, volume);
  const StoredType first = volume.channels[chosen[0]].type;
  const bool mixed = std::ranges::any_of(
      chosen, [&](std::size_t channel) { return volume.channels[channel].type != first; });
  std::string text = std::to_string(dims.x) + "x" + std::to_string(dims.y) + "x" + std::to_string(dims.z) +
                     " " + (mixed ? "of several types" : std::string(nameOf(first)));
  if (chosen.size() > 1) text += ", " + std::to_string(chosen.size()) + " channels";
  return text;
}

LoadedPart load(const VolumeFile& file, const Part& requested, Loading& loading) {
  const std::string name = shown(file.path);
  checkIndex(name, "volume", requested.volume, file.volumes.size());
  const VolumeInfo& volume = file.volumes[requested.volume];
  checkIndex(name, "level", requested.level, volume.levels.size());
  checkIndex(name, "time", requested.time, volume.times.count);
  Part part = requested;
  std::ranges::sort(part.channels);
  for (const std::size_t channel : part.channels)
    checkIndex(name, "channel", channel, volume.channels.size());
  if (std::ranges::adjacent_find(part.channels) != part.channels.end())
    throw Error(ErrorCode::badInput, name + ": channels: expected each once, found one twice");
  part.channels = orAll(part.channels, volume);
  loading.checkMemory(name + ": " + description(volume, part.level, part.channels),
                      memoryBytes(volume, part.level, part.channels));

  LoadedPart loaded{volume.levels[part.level], {}};
  std::vector<VoxelBuffer> voxels = file.read(volume, part, loading);
  for (std::size_t i = 0; i < part.channels.size(); ++i) {
    const ChannelInfo& info = volume.channels[part.channels[i]];
    loaded.channels.push_back(
        {info.name, info.unit, std::move(voxels.at(i)), info.slope, info.intercept, info.look});
  }
  return loaded;
}

LoadedPart load(const VolumeFile& file, const Part& part, const LoadOptions& options) {
  std::uint64_t bytes = 0;
  if (part.volume < file.volumes.size() && part.level < file.volumes[part.volume].levels.size())
    bytes = storedBytes(file.volumes[part.volume], part.level, {});
  Loading loading(options, bytes);
  return load(file, part, loading);
}

}  // namespace scolopax::io
