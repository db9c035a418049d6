// SPDX-License-Identifier: Apache-2.0
// What a method draws on average, and how far chance may carry that.
#pragma once
#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::random_scenes {

/// Means over independent values, of every pixel and, as the last entry, of the whole picture. Values are
/// samples where a scene asks for independent ones; else means of the samples of one scrambling.
struct Estimates {
  double count = 0;
  std::vector<glm::dvec4> mean, variance, least, most;  ///< variance of one value
};

/// How many pictures of different seeds, and how many samples in each.
struct Effort {
  int seeds, samples;
};

/// Draws with the scene's method. `round` chooses the seeds.
Estimates estimate(const std::shared_ptr<const Volume>& volume, const Scene& scene, Effort effort,
                   std::uint32_t round);

/// Fetches and other work of one sample of the whole picture, in units of a fetch: the same on every machine
/// but for quadrature, where it depends on the processor's vectors.
double costOf(const std::shared_ptr<const Volume>& volume, const Scene& scene);

/// By how much a mean of `count` values between 0 and `range` of that variance may be off (Maurer and Pontil,
/// "Empirical Bernstein bounds and sample variance penalization", 2009, theorem 4), at a chance of 4
/// exp(-logTerm) for both sides together.
double empiricalBernstein(double variance, double range, double count, double logTerm);

/// Bound of what one sample can be in any component.
double largestSample(const Scene& scene);

}  // namespace scolopax::random_scenes
