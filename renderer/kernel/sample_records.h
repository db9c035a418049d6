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

/// First collision of every lane's ray, for pictures of depth and channels.
template <class L>
struct FirstCollisionOf {
  /// World units; integrators give it along the ray, passes along the view direction.
  typename L::Float depth{0.0f};
  typename L::Int channel{-1};  ///< index among the visible channels; -1: no collision
};
using FirstCollision = FirstCollisionOf<One>;

}  // namespace scolopax::kernel
