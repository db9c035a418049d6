// SPDX-License-Identifier: Apache-2.0
// The double-precision answer for one ray: what "error" means for every other method. Slow and obvious,
// and shares no code with the kernels.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/channel_curves.h"

namespace scolopax::reference {

struct RayResult {
  glm::dvec4 rgba{0};  ///< linear, premultiplied; alpha = 1 - transmittance
  double error = 0;    ///< estimated bound of the absolute error of each component
};

/// Emission and absorption along rays: C = integral of T sum_n sigma_n c_n dt, T = exp(-integral of sum_n
/// sigma_n dt), over t >= 0 inside the volume's box.
///
/// The ray is cut at every plane through voxel centres, and inside each cell where a channel's scalar, there
/// a cubic of t, takes a value at which its curves have a knot. No feature is narrower than the pieces that
/// are left, and each is bisected until two Gauss rules agree.
class Integrator {
 public:
  /// Keeps a reference to `volume`. Throws Error(badInput) for a scene that does not fit it. `tolerance` is
  /// relative to the alpha that a stretch of the ray adds, and so bounds the absolute error of the whole.
  Integrator(const Volume& volume, const Scene& scene, double tolerance = 1e-7);

  /// `direction` need not have length 1. Throws Error(badInput) when it is 0 or anything is not finite.
  RayResult trace(const glm::dvec3& originWorld, const glm::dvec3& directionWorld) const;

 private:
  struct ActiveChannel {
    const Channel* data;
    ChannelCurves curves;
  };
  const Volume& volume_;
  BlendMode blend_;
  double tolerance_;
  glm::dmat3 voxelFromWorld_;
  glm::dvec3 voxelZero_;  // world position of voxel (0,0,0)
  std::vector<ActiveChannel> channels_;
};

/// One ray without keeping an Integrator.
RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld);

}  // namespace scolopax::reference
