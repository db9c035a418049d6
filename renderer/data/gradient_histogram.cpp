// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/gradient_histogram.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "renderer/core/shared_builds.h"
#include "renderer/data/measuring.h"
#include "renderer/data/transfer_function.h"
#include "renderer/kernel/lanes.h"

namespace scolopax {
namespace {

constexpr std::size_t kBins = GradientHistogram::kBins;
static_assert(kBins == Histogram::kBins);

/// An opacity up to this may be rounding of the position, and counts as 0.
constexpr float kLeastOpacity = 1e-6f;

using Rows = tbb::blocked_range<std::size_t>;

/// The gradients of a channel at its voxels, row by row.
template <class T>
class GradientRows {
 public:
  GradientRows(const StridedVoxels<T>& voxels, const Grid& grid)
      : voxels_(voxels), dims_(grid.dims), fromVoxel_(grid.gradientFromVoxel()) {}
  Rows all() const { return {0, std::size_t(dims_.y) * std::size_t(dims_.z)}; }
  std::size_t length() const { return std::size_t(dims_.x); }
  const T& voxel(std::size_t row, std::size_t x) const { return voxels_[row * length() + x]; }

  /// |gradient|^2 of a row's voxels, in stored values per smallest spacing. Volume keeps stored values below
  /// 2^124, so that the squares are finite. Not finite where the value or a difference is not.
  void squares(std::size_t row, std::vector<double>& out) const {
    const int y = int(row % std::size_t(dims_.y)), z = int(row / std::size_t(dims_.y));
    const Neighbours alongY(y, dims_.y), alongZ(z, dims_.z);
    const T *lowY = rowAt(alongY.low, z), *highY = rowAt(alongY.high, z);
    const T *lowZ = rowAt(y, alongZ.low), *highZ = rowAt(y, alongZ.high);
    const T* own = rowAt(y, z);
    out.resize(length());
    for (int x = 0; x < dims_.x; ++x) {
      const std::size_t at = std::size_t(x) * voxels_.stride;
      const Neighbours alongX(x, dims_.x);
      const double difference = double(own[std::size_t(alongX.high) * voxels_.stride]) -
                                double(own[std::size_t(alongX.low) * voxels_.stride]);
      const glm::dvec3 perVoxel(difference * alongX.share,
                                (double(highY[at]) - double(lowY[at])) * alongY.share,
                                (double(highZ[at]) - double(lowZ[at])) * alongZ.share);
      const glm::dvec3 gradient = fromVoxel_ * perVoxel;
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
      out[std::size_t(x)] = std::isfinite(double(own[at])) ? glm::dot(gradient, gradient) : kNone;
    }
  }

 private:
  struct Neighbours {
    int low, high;
    double share;  ///< factor from their difference to the slope per voxel
    Neighbours(int at, int size)
        : low(std::max(at - 1, 0)),
          high(std::min(at + 1, size - 1)),
          share(high > low ? 1.0 / double(high - low) : 0.0) {}
  };
  const T* rowAt(int y, int z) const {
    const std::size_t row = std::size_t(z) * std::size_t(dims_.y) + std::size_t(y);
    return voxels_.first + row * length() * voxels_.stride;
  }

  StridedVoxels<T> voxels_;
  glm::ivec3 dims_;
  glm::dmat3 fromVoxel_;
};

/// Calls visit(row, squares) for the rows of a range.
template <class T, class Visit>
void forRows(const GradientRows<T>& rows, const Rows& range, const std::stop_token& stop, Visit&& visit) {
  std::vector<double> squares;
  for (std::size_t row = range.begin(); row < range.end(); ++row) {
    checkWanted(stop);
    rows.squares(row, squares);
    visit(row, squares);
  }
}

/// Largest finite |gradient|^2 of all voxels.
template <class T>
double largestSquare(const GradientRows<T>& rows, const std::stop_token& stop) {
  return tbb::parallel_reduce(
      rows.all(), 0.0,
      [&](const Rows& range, double largest) {
        forRows(rows, range, stop, [&](std::size_t, const std::vector<double>& squares) {
          for (const double square : squares)
            if (std::isfinite(square)) largest = std::max(largest, square);
        });
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

/// What one thread has counted.
struct GradientCounts {
  std::vector<std::uint64_t> joint = std::vector<std::uint64_t>(kBins * kBins);
  std::vector<ValueInterval> stored =
      std::vector<ValueInterval>(kBins, {kernel::kInfinity, -kernel::kInfinity});
  std::uint64_t nonFinite = 0;
};

std::uint64_t totalOf(const std::vector<std::uint64_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

template <class T>
GradientHistogram measure(const GradientRows<T>& rows, const Channel& channel, double smallestSpacing,
                          const std::stop_token& stop) {
  const double largest = std::sqrt(largestSquare(rows, stop));
  const double binsPerUnit = largest > 0 ? double(kBins) / largest : 0.0;
  tbb::enumerable_thread_specific<GradientCounts> ofThreads;
  tbb::parallel_for(rows.all(), [&](const Rows& range) {
    GradientCounts& counts = ofThreads.local();
    forRows(rows, range, stop, [&](std::size_t row, const std::vector<double>& squares) {
      for (std::size_t x = 0; x < squares.size(); ++x) {
        if (!std::isfinite(squares[x])) {
          ++counts.nonFinite;
          continue;
        }
        const auto stored = float(rows.voxel(row, x));
        const std::size_t value = channel.histogram.binOf(channel.slope * double(stored) + channel.intercept);
        const std::size_t steepness = std::min(std::size_t(std::sqrt(squares[x]) * binsPerUnit), kBins - 1);
        ++counts.joint[value * kBins + steepness];
        ValueInterval& bin = counts.stored[value];
        bin = {std::min(bin.lo, stored), std::max(bin.hi, stored)};
      }
    });
  });

  GradientCounts all;
  for (const GradientCounts& counts : ofThreads) {
    for (std::size_t i = 0; i < all.joint.size(); ++i) all.joint[i] += counts.joint[i];
    for (std::size_t i = 0; i < kBins; ++i)
      all.stored[i] = {std::min(all.stored[i].lo, counts.stored[i].lo),
                       std::max(all.stored[i].hi, counts.stored[i].hi)};
    all.nonFinite += counts.nonFinite;
  }
  GradientHistogram histogram;
  histogram.finiteCount = totalOf(all.joint);
  histogram.nonFiniteCount = all.nonFinite;
  if (largest > 0)
    histogram.maximum =
        std::min(largest / smallestSpacing * std::abs(channel.slope), std::numeric_limits<double>::max());
  histogram.counts = std::move(all.joint);
  histogram.stored = std::move(all.stored);
  return histogram;
}

}  // namespace

std::vector<std::uint64_t> GradientHistogram::bins() const {
  std::vector<std::uint64_t> sums(kBins);
  for (std::size_t i = 0; i < counts.size(); ++i) sums[i % kBins] += counts[i];
  return sums;
}

GradientHistogram measureGradientHistogram(const Volume& volume, int channel, const std::stop_token& stop) {
  const Channel& measured = volume.channels()[std::size_t(channel)];
  checkWanted(stop);
  return visitScalarType(measured.voxels.type(), [&](auto zero) {
    using T = decltype(zero);
    const Grid& grid = volume.grid();
    return measure(GradientRows<T>(measured.voxels.as<T>(), grid), measured, grid.smallestSpacing(), stop);
  });
}

std::shared_ptr<const GradientHistogram> sharedGradientHistogram(
    const std::shared_ptr<const Volume>& volume, int channel, const std::stop_token& stop,
    const std::shared_ptr<MemoryBudget>& memory) {
  // A weak pointer distinguishes a new volume at an old address from the old one.
  using Builds = SharedBuilds<std::weak_ptr<const Volume>, GradientHistogram,
                              std::owner_less<std::weak_ptr<const Volume>>>;
  static std::array<Builds, std::size_t(kMaxChannels)> builds;
  // While measuring, every thread has its own counts.
  constexpr std::size_t kBytes = kBins * kBins * sizeof(std::uint64_t) + kBins * sizeof(ValueInterval);
  const auto copies = std::size_t(tbb::this_task_arena::max_concurrency() + 1);
  return builds[std::size_t(channel)].get(
      volume,
      measuring<GradientHistogram>(memory, copies * kBytes,
                                   [volume, channel](const std::stop_token& abandoned) {
                                     return measureGradientHistogram(*volume, channel, abandoned);
                                   }),
      stop);
}

double gradientQuantile(const GradientHistogram& histogram, const ChannelFacts& channel,
                        const ChannelAppearance& look, double p) {
  ChannelAppearance opacity = look;
  opacity.density = 1;
  opacity.gradientOpacity.reset();
  const TransferFunction transfer(channel, opacity);
  const auto visible = [&](float lo, float hi) { return transfer.majorant({lo, hi}) > kLeastOpacity; };
  std::vector<std::uint64_t> wholly(kBins), partly(kBins);
  for (std::size_t value = 0; value < kBins; ++value) {
    const ValueInterval v = histogram.stored[value];
    if (!(v.lo <= v.hi) || !visible(v.lo, v.hi)) continue;
    const bool atBothEnds = visible(v.lo, v.lo) && visible(v.hi, v.hi);
    for (std::size_t i = 0; i < kBins; ++i) {
      const std::uint64_t count = histogram.counts[value * kBins + i];
      partly[i] += count;
      if (atBothEnds) wholly[i] += count;
    }
  }
  const std::vector<std::uint64_t> counted = totalOf(wholly) > 0   ? wholly
                                             : totalOf(partly) > 0 ? partly
                                                                   : histogram.bins();

  const double rank = std::clamp(p, 0.0, 1.0) * double(totalOf(counted));
  double below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    const auto count = double(counted[i]);
    if (count > 0 && below + count >= rank)
      return (double(i) + (rank - below) / count) / double(kBins) * histogram.maximum;
    below += count;
  }
  return 0;  // no voxel was counted
}

}  // namespace scolopax
