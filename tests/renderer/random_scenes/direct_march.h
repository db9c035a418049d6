// SPDX-License-Identifier: Apache-2.0
// The tester's own picture: PROTOCOL.md's "exact meaning" in double precision, marched in small steps that
// are halved until halving changes nothing. It shares no code with the reference or the kernels.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/data/scene.h"
#include "tests/renderer/random_scenes/march_steps.h"
#include "tests/renderer/random_scenes/random_volume.h"

namespace scolopax::random_scenes {

struct Marched {
  glm::dvec4 rgba{0};  ///< linear, premultiplied
  double error = 0;    ///< what the last halving of every step changed, added up; of each component
  std::vector<Run> runs;

  /// Bound of the optical depth that is passed over, or taken for more, by who looks at the field only every
  /// `step`: where decisions hold for less than two of them.
  double depthOfRunsBelow(double step) const;
};

/// The ray through the centre of a pixel.
Marched directMarch(const VolumeSource& source, const Scene& scene, int column, int row);

}  // namespace scolopax::random_scenes
