// SPDX-License-Identifier: Apache-2.0
// The double-precision answer for one ray: what "error" means for every other method. Slow and obvious,
// and shares no code with the kernels.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/lighting.h"
#include "renderer/reference/stretch.h"

namespace scolopax::reference {

struct RayResult {
  glm::dvec4 rgba{0};  ///< linear, premultiplied; alpha = 1 - transmittance
  double error = 0;    ///< estimated bound of the absolute error of each component
};

/// Light along rays: C = integral of T sigma L dt, T = exp(-integral of sigma dt), over t >= 0 inside the
/// volume's box, where the blend mode says what extinction sigma and radiance L are. Density: the sum, and
/// the mean weighted by extinction. Max: the largest, and its channel's. Mix: the largest, and sum w_n
/// sigma_n L_n over it. Composite: every channel alone, colours added, transmittances multiplied.
///
/// The ray is cut at every plane through voxel centres, inside each cell where a channel's scalar, there a
/// cubic of t, takes a value at which its curves have a knot, and, in max and mix, where the largest
/// extinction passes from one channel to another. Without light, no feature is narrower than the pieces that
/// are left, and each is bisected until two Gauss rules agree.
///
/// With light, radiance is not smooth within the pieces, and costs a ray to every light: rules of lower
/// order, a looser tolerance, and optical depths of shadow rays to a tenth of it.
class Integrator {
 public:
  static constexpr double kTolerance = 1e-7, kToleranceLit = 1e-4;

  /// Keeps a reference to `volume`. Throws Error(badInput) for a scene that does not fit it.
  Integrator(const Volume& volume, const Scene& scene)
      : Integrator(volume, scene, scene.shading || scene.shadows ? kToleranceLit : kTolerance) {}
  /// `tolerance` is relative to the alpha that a stretch of the ray adds, and so bounds the absolute error of
  /// the whole; for lights whose intensities add up to about 1.
  Integrator(const Volume& volume, const Scene& scene, double tolerance);

  /// `direction` need not have length 1. Throws Error(badInput) when it is 0 or anything is not finite.
  RayResult trace(const glm::dvec3& originWorld, const glm::dvec3& directionWorld) const;

 private:
  using Channels = std::span<const ActiveChannel>;
  /// Relative to voxel (0,0,0), in world units; direction of length 1.
  struct Ray {
    glm::dvec3 origin, direction;
  };
  struct Medium;
  struct PieceLight;
  struct Path;
  Path follow(const Ray& ray, Channels channels) const;
  template <int kFine, int kCoarse, class MediumAt>
  void integrate(const MediumAt& mediumAt, double length, double begin, double end, Path& path) const;
  template <int N, class MediumAt>
  static PieceLight lightOf(const MediumAt& mediumAt, double length, double begin, double end);
  Medium mediumAt(const Ray& ray, Channels channels, const Stretch& stretch, double u) const;
  double transmittance(const glm::dvec3& pointVoxel, const glm::dvec3& direction, double distance,
                       Channels channels) const;
  double opticalDepth(const Stretch& stretch, double begin, double end) const;

  glm::ivec3 dims_;
  BlendMode blend_;
  double tolerance_;
  double floor_;        // of the tolerance: absolute error that a piece may always have
  double opaqueDepth_;  // what lies behind this optical depth is not looked at
  glm::dmat3 worldFromVoxel_, voxelFromWorld_;
  double smallestSpacing_;
  glm::dvec3 voxelZero_;  // world position of voxel (0,0,0)
  Lighting lighting_;
  std::vector<ActiveChannel> channels_;
};

/// One ray without keeping an Integrator.
RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld);

}  // namespace scolopax::reference
