// SPDX-License-Identifier: Apache-2.0
// The double-precision answer for one ray, against which the error of every other method is measured. Slow
// and obvious, and shares no code with the kernels.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/crossings.h"
#include "renderer/reference/light_cuts.h"
#include "renderer/reference/lighting.h"
#include "renderer/reference/piece_rules.h"
#include "renderer/reference/stretch.h"

namespace scolopax::reference {

struct RayResult {
  glm::dvec4 rgba{0};  ///< linear, premultiplied; alpha = 1 - transmittance
  /// Estimated bound of the absolute error of each component: by how much the rules differ in the pieces of
  /// the ray, and what is cut off behind thick matter and in deep shadow. Shadows and gaps of light that are
  /// narrower than a fifth of a piece may be missed; a piece lies inside one cell.
  double error = 0;
};

/// Light along rays: C = integral of T sigma L dt, T = exp(-integral of sigma dt), over t >= 0 inside the
/// volume's box. The blend mode defines extinction sigma and radiance L. Density: the sum of the extinctions,
/// and the mean of the radiances weighted by extinction. Max: the largest extinction, and the radiance of its
/// channel. Mix: the largest extinction, and sum w_n sigma_n L_n divided by it. Composite: every channel
/// alone, colours added, transmittances multiplied.
///
/// The ray is cut at every plane through voxel centres, and where the interpolation of a channel is nearest
/// also at the faces of voxels. In between, where a channel's scalar is a polynomial of t (ScalarAlong), it
/// is cut where the scalar takes a value at which the channel's curves have a knot, where opacity by the
/// gradient has a kink or a jump (FactorAlong), and, in max and mix, where the largest extinction passes from
/// one channel to another. Without light, no feature is narrower than the resulting pieces, and each is
/// bisected until two Gauss rules agree.
///
/// Where a ray crosses a surface, it loses the share of its light that is the surface's opacity, in every
/// blend mode. A surface is lit as matter is whose gradient is steep.
///
/// With shading, the ray is also cut where a normal flips, where n.l or n.h passes zero, where a fade
/// saturates, and wherever a highlight would be narrower than a piece (LightCuts). Edges of shadows are left
/// to bisection, with rules that detect a jump anywhere in a piece (roughPiece). With light the tolerance is
/// looser, because a point may cost a ray to every light.
class Integrator {
 public:
  static constexpr double kTolerance = 1e-7, kToleranceLit = 1e-4;

  /// Keeps a reference to `volume`. Throws Error(badInput) for a scene that does not fit it.
  Integrator(const Volume& volume, const Scene& scene)
      : Integrator(volume, scene, scene.shading || scene.shadows ? kToleranceLit : kTolerance) {}
  /// The absolute error of a piece may be, however bright the light, `tolerance` times the alpha that the
  /// piece adds; or, so that bisection ends at jumps, 1e-2 times `tolerance` with light and 1e-9 times
  /// without.
  Integrator(const Volume& volume, const Scene& scene, double tolerance);

  /// `direction` need not have length 1. Throws Error(badInput) when it is 0 or anything is not finite.
  RayResult trace(const glm::dvec3& originWorld, const glm::dvec3& directionWorld) const;

 private:
  using Channels = std::span<const ActiveChannel>;
  /// Relative to voxel (0,0,0), in world units; direction of length 1.
  struct Ray {
    glm::dvec3 origin, direction;
  };
  struct Path;
  Path follow(const Ray& ray, Channels channels) const;
  void meet(const Ray& ray, const RayCells& cells, const Crossing& crossing, Channels channels,
            Path& path) const;
  RayCells cutAtAll(const glm::dvec3& originVoxel, const glm::dvec3& directionWorld, double length,
                    Channels channels) const;
  using Rule = PieceEstimate(const MediumAt&, double length);
  void integrate(Rule& rule, const MediumAt& mediumAt, double stretchLength, double begin, double end,
                 Path& path) const;
  Medium mediumAt(const Ray& ray, Channels channels, const Stretch& stretch, double u) const;
  std::vector<ArrivingLight> lightsAt(const glm::dvec3& pointVoxel, bool onSurface, const glm::dvec3& eye,
                                      Channels channels) const;
  double transmittance(const glm::dvec3& pointVoxel, bool onSurface, const glm::dvec3& direction,
                       double distance, Channels channels) const;
  double opticalDepth(const Stretch& stretch, double begin, double end, double allowed) const;

  glm::ivec3 dims_;
  BlendMode blend_;
  double tolerance_;
  double floor_;          // absolute error that a piece may always have, as a share of the tolerance
  double brightest_ = 0;  // upper bound of the radiance
  double opaqueDepth_;    // the ray ends at this optical depth
  glm::dmat3 worldFromVoxel_, voxelFromWorld_;
  double smallestSpacing_;
  glm::dvec3 voxelZero_;  // world position of voxel (0,0,0)
  Clipping clipping_;
  Lighting lighting_;
  LightCuts lightCuts_;
  std::vector<ActiveChannel> channels_;
};

/// Traces one ray without keeping an Integrator.
RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld);

}  // namespace scolopax::reference
