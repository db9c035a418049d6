// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ensemble.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kStatisticCount = 4;
constexpr std::string_view kStatisticNames[kStatisticCount] = {"mean", "variance", "minimum", "maximum"};

/// The statistics of one channel, voxel by voxel.
struct ChannelStatistics {
  VoxelBuffer all[kStatisticCount];

  explicit ChannelStatistics(std::size_t voxels) {
    for (VoxelBuffer& one : all) one = VoxelBuffer(ScalarType::f32, voxels);
  }

  /// Adds the member of this number, from 1.
  void add(const ChannelSource& member, std::size_t number) {
    visitScalarType(member.voxels.type(), [&](auto zero) {
      const auto stored = member.voxels.as<decltype(zero)>();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, stored.size(), 1 << 15), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          addValue(i, member.slope * double(stored[i]) + member.intercept, double(number));
      });
    });
  }

  /// Sums of squares become variances.
  void finish(std::size_t members) {
    for (float& sum : all[1].as<float>()) sum = float(double(sum) / double(members - 1));
  }

 private:
  void addValue(std::size_t i, double value, double number) {
    float& mean = all[0].as<float>()[i];
    float& squares = all[1].as<float>()[i];
    float& least = all[2].as<float>()[i];
    float& most = all[3].as<float>()[i];
    if (number == 1) mean = squares = 0, least = most = float(value);
    if (std::isnan(mean)) return;
    if (!std::isfinite(value)) {
      mean = squares = least = most = std::numeric_limits<float>::quiet_NaN();
      return;
    }
    const double before = value - double(mean), next = double(mean) + before / number;
    squares = float(double(squares) + before * (value - next));
    mean = float(next);
    least = std::min(least, float(value));
    most = std::max(most, float(value));
  }
};

VolumeInfo statisticsOf(const VolumeInfo& members) {
  VolumeInfo info = members;
  info.path += (info.path.empty() ? "" : "/") + std::string(kStatistics);
  info.times = {};
  info.derived = true;
  info.channels.clear();
  for (const ChannelInfo& channel : members.channels)
    for (const std::string_view name : kStatisticNames) {
      const bool squared = name == "variance" && !channel.unit.empty();
      info.channels.push_back({.name = channel.name + " " + std::string(name),
                               .unit = squared ? "(" + channel.unit + ")^2" : channel.unit,
                               .type = StoredType::f32});
    }
  return info;
}

std::vector<VoxelBuffer> readStatistics(const VolumeFile& file, std::size_t volume, const Part& part,
                                        Loading& loading) {
  const VolumeInfo& members = file.volumes[volume];
  Part member{.volume = volume, .level = part.level};
  for (const std::size_t channel : part.channels)
    if (member.channels.empty() || member.channels.back() != channel / kStatisticCount)
      member.channels.push_back(channel / kStatisticCount);
  const std::size_t voxels = members.levels[part.level].voxelCount();
  loading.checkMemory(
      shown(file.path) + ": statistics over " + std::to_string(members.times.count) + " members",
      saturatingSum(memoryBytes(members, part.level, member.channels),
                    saturatingProduct(voxels * sizeof(float), kStatisticCount * member.channels.size())));
  std::vector<ChannelStatistics> statistics;
  for (std::size_t i = 0; i < member.channels.size(); ++i) statistics.emplace_back(voxels);
  for (member.time = 0; member.time < members.times.count; ++member.time) {
    const std::vector<ChannelSource> values = load(file, member, loading).channels;
    loading.checkStop();
    for (std::size_t i = 0; i < values.size(); ++i) statistics[i].add(values[i], member.time + 1);
  }
  for (ChannelStatistics& one : statistics) one.finish(members.times.count);
  std::vector<VoxelBuffer> result;
  for (const std::size_t channel : part.channels) {
    const auto at = std::ranges::find(member.channels, channel / kStatisticCount) - member.channels.begin();
    result.push_back(std::move(statistics[std::size_t(at)].all[channel % kStatisticCount]));
  }
  return result;
}

}  // namespace

std::shared_ptr<const VolumeFile> withStatistics(std::shared_ptr<const VolumeFile> file) {
  auto result = std::make_shared<VolumeFile>(*file);
  std::vector<std::size_t> membersOf;  // of the volumes that are added
  for (std::size_t i = 0; i < file->volumes.size(); ++i)
    if (file->volumes[i].times.count > 1) {
      result->volumes.push_back(statisticsOf(file->volumes[i]));
      membersOf.push_back(i);
    }
  result->read = [file, membersOf](const VolumeInfo& volume, const Part& part, Loading& loading) {
    const std::size_t own = file->volumes.size();
    return part.volume < own ? file->read(volume, part, loading)
                             : readStatistics(*file, membersOf[part.volume - own], part, loading);
  };
  return result;
}

}  // namespace scolopax::io
