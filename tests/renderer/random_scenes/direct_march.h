// SPDX-License-Identifier: Apache-2.0
// An independent ray marcher: the section "Exact meaning" of PROTOCOL.md in double precision, in small steps
// that are halved until halving has no effect. It shares no code with the reference or the kernels.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/data/scene.h"
#include "tests/renderer/random_scenes/march_steps.h"
#include "tests/renderer/random_scenes/random_volume.h"

namespace scolopax::random_scenes {

struct Marched {
  glm::dvec4 rgba{0};  ///< linear, premultiplied
  double error = 0;    ///< of each component: the changes by the last halving of every step, added up
  std::vector<Run> runs;

  /// Bound on the optical depth that a marcher with this step may miss or count twice: that of all runs in
  /// which the decisions stay the same for less than two steps.
  double depthOfRunsBelow(double step) const;
};

/// Marches the ray through the centre of a pixel.
Marched directMarch(const VolumeSource& source, const Scene& scene, int column, int row);

}  // namespace scolopax::random_scenes
