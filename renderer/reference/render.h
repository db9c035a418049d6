// SPDX-License-Identifier: Apache-2.0
// A whole picture from the reference integrator, with its remaining standard error.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "renderer/data/image.h"
#include "renderer/reference/integrator.h"

namespace scolopax::reference {

struct ReferenceImage {
  Image image;
  /// Per pixel and component: the noise left by sampling the pixel's area. 0 for the point filter.
  std::vector<glm::vec4> standardError;
  double maximumRayError = 0;  ///< largest RayResult::error of all rays
};

/// How a reference picture is rendered.
struct ReferenceOptions {
  int samplesPerAxis = 1;
  std::uint64_t seed = 0;
  std::optional<double> tolerance =
      std::nullopt;  ///< of the Integrator, in (0, 1); by default the Integrator's own
  /// Renders only every so many pixels along x and along y, numbers every / 2, every / 2 + every and so on,
  /// as a picture that much smaller. A divisor of the scene's width and height.
  int every = 1;
};

/// Box filter: every pixel is divided into samplesPerAxis^2 strata, and two rays go through random points of
/// each; their differences give the standard error. Point filter: one ray through the pixel's centre. Throws
/// Error(badInput) for an invalid scene, camera or option.
ReferenceImage renderReference(const Volume& volume, const Scene& scene, const ReferenceOptions& options);
inline ReferenceImage renderReference(const Volume& volume, const Scene& scene, int samplesPerAxis,
                                      std::uint64_t seed = 0) {
  return renderReference(volume, scene, ReferenceOptions{samplesPerAxis, seed, {}, 1});
}

}  // namespace scolopax::reference
