// SPDX-License-Identifier: Apache-2.0
// What every tracker returns, and the tentative collision they share.
#pragma once
#include <optional>

#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/classify.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/sample_volume.h"

namespace scolopax::kernel {

/// Nearest accepted collision along a ray.
struct Collision {
  float t;         ///< world units along the ray
  int channel;     ///< among the visible channels
  float position;  ///< on that channel's curves
};

/// Tentative collisions after which a sample gives up and counts as truncated: a bound on the work of one
/// ray, far above what any thickness that can be told from opaque needs.
inline constexpr std::uint32_t kMaxTentativeCollisions = 1u << 20;

/// Fetches one channel at a tentative collision and accepts with probability extinction / majorant (Eq. 4).
/// Strictly below, so that zero extinction is never hit; voxels that are not finite have none.
SCOLOPAX_HD inline bool accept(const SceneView& scene, int channel, float majorant, glm::vec3 point, float u,
                               float* position, SampleCost* cost) {
  ++cost->fetches;
  const float stored = sampleStored(scene.channels[channel], scene.dims, point);
  if (!isFinite(stored)) return false;
  *position = curvePosition(scene.channels[channel], stored);
  return u * majorant < extinctionAt(scene.channels[channel], *position);
}

}  // namespace scolopax::kernel
