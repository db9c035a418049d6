// SPDX-License-Identifier: Apache-2.0
// A whole picture from the reference integrator, with its remaining standard error.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
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

/// Box filter: every pixel is divided into samplesPerAxis^2 strata, and two rays go through random points of
/// each; their differences give the standard error. Point filter: one ray through the pixel's centre. Throws
/// Error(badInput) for an invalid scene or camera, or samplesPerAxis < 1.
ReferenceImage renderReference(const Volume& volume, const Scene& scene, int samplesPerAxis,
                               std::uint64_t seed = 0);

}  // namespace scolopax::reference
