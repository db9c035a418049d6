// SPDX-License-Identifier: Apache-2.0
// Included after a lane type; there is one including file for each lane type.
#pragma once
#include "renderer/cpu/sample_lanes.h"
#include "tests/support/sample_lanes.h"

namespace scolopax::SCOLOPAX_SIMD_SPACE {

SCOLOPAX_LANES_APART inline void sampleLanes(const kernel::SceneView& scene, std::uint32_t channels,
                                             const glm::vec3* points, float (*values)[test::kMostLanes]) {
  Vec at(0.0f);
  for (int i = 0; i < kLanes; ++i)
    for (int axis = 0; axis < 3; ++axis) put(points[i][axis], i, &at[axis]);
  Float found[kernel::kMaxVisibleChannels];
  sampleChannels(scene, channels, at, found);
  for (int n = 0; n < scene.channelCount; ++n)
    if (channels >> n & 1) store(found[n], values[n]);
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
