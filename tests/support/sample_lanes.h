// SPDX-License-Identifier: Apache-2.0
// Sampling of many points at once (renderer/cpu/sample_lanes.h), for tests and benchmarks, which are not
// compiled for these instruction sets themselves.
#pragma once
#include <glm/vec3.hpp>

#include "renderer/kernel/views.h"

namespace scolopax::test {

inline constexpr int kMostLanes = 16;

/// Writes the values of `channels` (bit n: channel n), at as many points as the instruction set has lanes, to
/// values[n].
using SampleLanes = void (*)(const kernel::SceneView& scene, std::uint32_t channels, const glm::vec3* points,
                             float (*values)[kMostLanes]);
struct LaneSampler {
  int lanes;
  SampleLanes sample;
};
LaneSampler avx2LaneSampler();
LaneSampler avx512LaneSampler();

}  // namespace scolopax::test
