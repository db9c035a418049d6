// SPDX-License-Identifier: Apache-2.0
// What integrators record of a sample besides its colour: its cost, and the first collision of its ray.
#pragma once
#include "renderer/kernel/lanes.h"

namespace scolopax::kernel {

/// Cost of one sample per lane, for tests, benchmarks and the cost heat map.
template <class L>
struct CostOf {
  using Word = typename L::Word;
  Word fetches{0u}, cellSteps{0u}, randomBlocks{0u}, truncated{0u};
};
using SampleCost = CostOf<One>;
SCOLOPAX_HD inline void addCost(SampleCost* sum, const SampleCost& cost) {
  sum->fetches += cost.fetches;
  sum->cellSteps += cost.cellSteps;
  sum->randomBlocks += cost.randomBlocks;
  sum->truncated += cost.truncated;
}

/// First collision of every lane's ray, for pictures of depth and channels.
template <class L>
struct FirstCollisionOf {
  /// World units; integrators give it along the ray, passes along the view direction.
  typename L::Float depth{0.0f};
  typename L::Int channel{-1};  ///< index among the visible channels; -1: no collision
};
using FirstCollision = FirstCollisionOf<One>;
/// Replaces first collisions, in lanes of `which`, where there is none yet or the given one is nearer.
template <class L>
SCOLOPAX_LANES void keepNearer(FirstCollisionOf<L>* first, typename L::Mask which, typename L::Float depth,
                               typename L::Int channel) {
  const typename L::Mask nearer = which & ((typename L::Int(0) > first->channel) | (depth < first->depth));
  first->depth = select(nearer, depth, first->depth);
  first->channel = select(nearer, channel, first->channel);
}

}  // namespace scolopax::kernel
