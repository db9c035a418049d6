// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/value_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace scolopax {
namespace {

constexpr std::size_t kMost = kernel::kMaxLevels;

/// All different ends, sorted; none if there are more than `most`.
std::optional<std::vector<float>> fewEnds(std::span<const ValueInterval> intervals, std::size_t most) {
  std::vector<float> found;
  float last = std::numeric_limits<float>::quiet_NaN();
  for (const ValueInterval& v : intervals) {
    if (!(v.lo <= v.hi)) continue;
    for (const float end : {v.lo, v.hi}) {
      if (end == last) continue;
      last = end;
      const auto at = std::lower_bound(found.begin(), found.end(), end);
      if (at != found.end() && *at == end) continue;
      if (found.size() == most) return std::nullopt;
      found.insert(at, end);
    }
  }
  return found;
}

/// At most `count` values that divide the sorted `ends` into parts of about equal size. Values that fill a
/// part by themselves, such as an empty background, are taken first, and the rest is divided among the
/// others.
std::vector<float> quantiles(std::vector<float> ends, std::size_t count) {
  std::vector<float> chosen;
  for (bool found = true; found && chosen.size() < count;) {
    found = false;
    const std::size_t part = ends.size() / (count - chosen.size()) + 1;
    std::vector<float> rest;
    for (std::size_t i = 0; i < ends.size();) {
      std::size_t next = i;
      while (next < ends.size() && ends[next] == ends[i]) ++next;
      if (next - i > part && chosen.size() < count) {
        chosen.push_back(ends[i]);
        found = true;
      } else {
        rest.insert(rest.end(), ends.begin() + std::ptrdiff_t(i), ends.begin() + std::ptrdiff_t(next));
      }
      i = next;
    }
    ends = std::move(rest);
  }
  const std::size_t left = std::min(count - chosen.size(), ends.size());
  for (std::size_t i = 0; i < left; ++i) chosen.push_back(ends[(2 * i + 1) * ends.size() / (2 * left)]);
  return chosen;
}

}  // namespace

std::vector<float> chooseLevels(std::span<const ValueInterval> intervals) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  float least = std::numeric_limits<float>::infinity(), most = -least;
  std::size_t finite = 0;
  for (const ValueInterval& v : intervals) {
    if (!(v.lo <= v.hi)) continue;
    least = std::min(least, v.lo);
    most = std::max(most, v.hi);
    ++finite;
  }
  const bool some = finite < intervals.size();  // whether some cells have no finite sample
  if (auto few = fewEnds(intervals, kMost - some)) {
    if (some) few->push_back(kNone);
    return *few;
  }
  // A subset of the ends is enough to estimate their density.
  constexpr std::size_t kSample = 1 << 15;
  const std::size_t stride = finite / kSample + 1;
  std::vector<float> ends;
  std::size_t seen = 0;
  for (const ValueInterval& v : intervals)
    if (v.lo <= v.hi && seen++ % stride == 0) ends.insert(ends.end(), {v.lo, v.hi});
  std::sort(ends.begin(), ends.end());
  constexpr std::size_t kParts = kMost / 2 - 1;
  std::vector<float> levels = quantiles(std::move(ends), kParts);
  for (std::size_t i = 0; i < kParts; ++i)
    levels.push_back(float(double(least) + (double(most) - double(least)) * double(i) / double(kParts)));
  levels.push_back(most);
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  if (some) levels.push_back(kNone);
  return levels;
}

kernel::LevelInterval encode(const ValueLevels& levels, ValueInterval interval) {
  const auto begin = levels.values.begin();
  auto end = levels.values.end();
  if (!(interval.lo <= interval.hi)) {
    const auto none = std::uint8_t(levels.values.size() - 1);
    return {none, none};
  }
  if (std::isnan(end[-1])) --end;
  const auto lo = std::upper_bound(begin, end, interval.lo) - 1;
  const auto hi = std::lower_bound(lo, end, interval.hi);
  return {std::uint8_t(lo - begin), std::uint8_t(hi - begin)};
}

ValueInterval ValueLevels::decode(kernel::LevelInterval interval) const {
  ValueInterval v{values[interval.lo], values[interval.hi]};
  if (!(v.lo <= v.hi))
    return {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  if (interval.lo == interval.hi) return v;
  if (v.lo != 0) v.lo -= slack;
  if (v.hi != 0) v.hi += slack;
  return v;
}

}  // namespace scolopax
