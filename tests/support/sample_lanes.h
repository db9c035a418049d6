// SPDX-License-Identifier: Apache-2.0
// Sampling of many points at once (renderer/cpu/sample_lanes.h), for tests and benchmarks that are compiled
// for no instruction set of their own.
#pragma once
#include <glm/vec3.hpp>

#include "renderer/kernel/views.h"

namespace scolopax::test {

inline constexpr int kMostLanes = 16;

/// Values of channels (bit n: channel n) at as many points as the set has lanes come into values[n].
using SampleLanes = void (*)(const kernel::SceneView& scene, std::uint32_t channels, const glm::vec3* points,
                             float (*values)[kMostLanes]);
struct LaneSampler {
  int lanes;
  SampleLanes sample;
};
LaneSampler avx2LaneSampler();
LaneSampler avx512LaneSampler();

}  // namespace scolopax::test
