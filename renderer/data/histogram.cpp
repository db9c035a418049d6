// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/histogram.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/data/volume.h"

namespace scolopax {
namespace {

constexpr std::size_t kQuantiles = 1025;
constexpr std::size_t kSubset = std::size_t(1) << 20;

/// Counts of every possible stored value: exact, and one pass.
template <class T>
std::vector<std::uint64_t> countValues(std::span<const T> voxels) {
  using Counts = std::vector<std::uint64_t>;
  const std::size_t values = std::size_t(1) << (8 * sizeof(T));
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels.size(), 1 << 20), Counts(values),
      [&](const tbb::blocked_range<std::size_t>& range, Counts counts) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          ++counts[std::size_t(int(voxels[i]) - int(std::numeric_limits<T>::min()))];
        return counts;
      },
      [](Counts a, const Counts& b) {
        for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
        return a;
      });
}

template <class T>
void measureIntegers(std::span<const T> voxels, double slope, double intercept, Histogram& h) {
  const auto counts = countValues(voxels);
  const auto valueAt = [&](std::size_t i) {
    return slope * double(int(i) + int(std::numeric_limits<T>::min())) + intercept;
  };
  std::vector<std::size_t> used;  // indices by increasing data value
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i] > 0) used.push_back(i);
  if (slope < 0) std::reverse(used.begin(), used.end());
  h.finiteCount = voxels.size();
  h.minimum = valueAt(used.front());
  h.maximum = valueAt(used.back());
  for (std::size_t i : used) h.bins[h.binOf(valueAt(i))] += counts[i];

  h.quantiles.reserve(kQuantiles);
  std::size_t at = 0;
  std::uint64_t below = 0;  // voxels below used[at]
  for (std::size_t q = 0; q < kQuantiles; ++q) {
    const double rank = double(q) / double(kQuantiles - 1) * double(h.finiteCount - 1);
    while (double(below + counts[used[at]]) <= rank) below += counts[used[at++]];
    h.quantiles.push_back(valueAt(used[at]));
  }
}

struct Extent {
  float lo = std::numeric_limits<float>::infinity();
  float hi = -std::numeric_limits<float>::infinity();
  std::uint64_t finite = 0;
};

Extent extentOf(std::span<const float> voxels) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels.size(), 1 << 16), Extent{},
      [&](const tbb::blocked_range<std::size_t>& range, Extent e) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const float v = voxels[i];
          if (!std::isfinite(v)) continue;
          e.lo = std::min(e.lo, v);
          e.hi = std::max(e.hi, v);
          ++e.finite;
        }
        return e;
      },
      [](Extent a, const Extent& b) {
        return Extent{std::min(a.lo, b.lo), std::max(a.hi, b.hi), a.finite + b.finite};
      });
}

void measureFloats(std::span<const float> voxels, double slope, double intercept, Histogram& h) {
  const Extent extent = extentOf(voxels);
  h.finiteCount = extent.finite;
  h.nonFiniteCount = voxels.size() - extent.finite;
  if (extent.finite == 0) return;
  const double a = slope * double(extent.lo) + intercept, b = slope * double(extent.hi) + intercept;
  h.minimum = std::min(a, b);
  h.maximum = std::max(a, b);
  for (const float v : voxels)
    if (std::isfinite(v)) ++h.bins[h.binOf(slope * double(v) + intercept)];

  std::vector<double> subset;
  // An odd stride visits rows, columns and slices evenly.
  const std::size_t stride = (std::max<std::size_t>(voxels.size() / kSubset, 1)) | 1;
  for (std::size_t i = 0; i < voxels.size(); i += stride)
    if (std::isfinite(voxels[i])) subset.push_back(slope * double(voxels[i]) + intercept);
  if (subset.empty()) subset = {h.minimum, h.maximum};
  std::sort(subset.begin(), subset.end());
  subset.front() = h.minimum;
  subset.back() = h.maximum;
  for (std::size_t q = 0; q < kQuantiles; ++q)
    h.quantiles.push_back(subset[q * (subset.size() - 1) / (kQuantiles - 1)]);
}

}  // namespace

Histogram measureHistogram(const VoxelBuffer& voxels, double slope, double intercept) {
  Histogram h;
  h.bins.assign(Histogram::kBins, 0);
  visitScalarType(voxels.type(), [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_same_v<T, float>)
      measureFloats(voxels.as<float>(), slope, intercept, h);
    else
      measureIntegers(voxels.as<T>(), slope, intercept, h);
  });
  return h;
}

double Histogram::quantile(double p) const {
  if (quantiles.empty()) return 0;
  const double at = std::clamp(p, 0.0, 1.0) * double(quantiles.size() - 1);
  const auto low = std::min(std::size_t(at), quantiles.size() - 1);
  const auto high = std::min(low + 1, quantiles.size() - 1);
  return std::lerp(quantiles[low], quantiles[high], at - double(low));
}

}  // namespace scolopax
