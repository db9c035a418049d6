// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/costs.h"

#include <tbb/parallel_reduce.h>

#include "renderer/data/pixel_loops.h"

namespace scolopax {

RenderStats withWork(RenderStats stats, const RenderStats& work) {
  stats.fetches += work.fetches;
  stats.cellSteps += work.cellSteps;
  stats.randomBlocks += work.randomBlocks;
  stats.truncatedRays += work.truncatedRays;
  return stats;
}

void Costs::reset(std::size_t pixels) {
  sums_ = {};
  pass_.assign(pixels, {});
}

void Costs::add(std::uint64_t* fetches) {
  const auto addRange = [&](const auto& range, RenderStats sum) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const kernel::SampleCost& cost = pass_[i];
      sum = withWork(sum, {0, cost.fetches, cost.cellSteps, cost.randomBlocks, cost.truncated});
      if (fetches) fetches[i] += cost.fetches;
      pass_[i] = {};
    }
    return sum;
  };
  sums_.rays += pass_.size();
  sums_ = withWork(sums_, tbb::parallel_reduce(pixelRange(pass_.size()), RenderStats(), addRange, withWork));
}

}  // namespace scolopax
