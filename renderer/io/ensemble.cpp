// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ensemble.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

enum Statistic : std::size_t { kMean, kVariance, kMinimum, kMaximum, kStatisticCount };
constexpr std::string_view kStatisticNames[kStatisticCount] = {"mean", "variance", "minimum", "maximum"};

/// Which statistics of one channel are asked for.
using Wanted = std::array<bool, kStatisticCount>;

/// The statistics that a channel's wanted ones need: the mean is what variances are updated from.
Wanted neededFor(Wanted wanted) {
  wanted[kMean] = wanted[kMean] || wanted[kVariance];
  return wanted;
}

/// The statistics of one channel, voxel by voxel.
struct ChannelStatistics {
  VoxelBuffer all[kStatisticCount];  ///< empty where not needed

  ChannelStatistics(const Wanted& needed, std::size_t voxels) {
    for (std::size_t i = 0; i < kStatisticCount; ++i)
      if (needed[i]) all[i] = VoxelBuffer(ScalarType::f32, voxels);
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
    for (float& sum : all[kVariance].as<float>()) sum = float(double(sum) / double(members - 1));
  }

 private:
  /// nullptr if the statistic is not needed.
  float* at(Statistic statistic, std::size_t i) {
    const auto values = all[statistic].as<float>();
    return values.empty() ? nullptr : &values[i];
  }

  /// What is not a number stays so, whatever is added.
  void addValue(std::size_t i, double value, double number) {
    if (!std::isfinite(value)) value = std::numeric_limits<double>::quiet_NaN();
    const bool replaces = number == 1 || std::isnan(value);
    if (float* least = at(kMinimum, i)) *least = replaces ? float(value) : std::min(*least, float(value));
    if (float* most = at(kMaximum, i)) *most = replaces ? float(value) : std::max(*most, float(value));
    float* mean = at(kMean, i);
    if (!mean) return;
    const double old = number == 1 ? 0 : double(*mean), before = value - old, next = old + before / number;
    if (float* squares = at(kVariance, i))
      *squares = float((number == 1 ? 0 : double(*squares)) + before * (value - next));
    *mean = float(next);
  }
};

/// Channels of the members, ascending, that these channels of their statistics are of.
std::vector<std::size_t> memberChannels(const std::vector<std::size_t>& channels) {
  std::vector<std::size_t> members;
  for (const std::size_t channel : channels)
    if (members.empty() || members.back() != channel / kStatisticCount)
      members.push_back(channel / kStatisticCount);
  return members;
}

/// For each of `members`, the statistics that are needed for `channels`.
std::vector<Wanted> neededOf(const std::vector<std::size_t>& channels,
                             const std::vector<std::size_t>& members) {
  std::vector<Wanted> needed(members.size(), Wanted{});
  std::size_t member = 0;
  for (const std::size_t channel : channels) {
    while (members[member] != channel / kStatisticCount) ++member;
    needed[member][channel % kStatisticCount] = true;
  }
  std::ranges::transform(needed, needed.begin(), neededFor);
  return needed;
}

VolumeInfo statisticsOf(const VolumeInfo& members) {
  VolumeInfo info = members;
  info.path += (info.path.empty() ? "" : "/") + std::string(kStatistics);
  info.times = {};
  info.derived = true;
  info.readBytes = [members](std::size_t level, const std::vector<std::size_t>& channels) {
    return saturatingProduct(storedBytes(members, level, memberChannels(channels)), members.times.count);
  };
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
  Part member{.volume = volume, .level = part.level, .channels = memberChannels(part.channels)};
  const std::vector<Wanted> needed = neededOf(part.channels, member.channels);
  std::size_t buffers = 0;
  for (const Wanted& one : needed) buffers += std::size_t(std::ranges::count(one, true));
  const std::size_t voxels = members.levels[part.level].voxelCount();
  loading.checkMemory(
      shown(file.path) + ": statistics over " + std::to_string(members.times.count) + " members",
      saturatingSum(memoryBytes(members, part.level, member.channels),
                    saturatingProduct(voxels * sizeof(float), buffers)));
  std::vector<ChannelStatistics> statistics;
  for (const Wanted& one : needed) statistics.emplace_back(one, voxels);
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
