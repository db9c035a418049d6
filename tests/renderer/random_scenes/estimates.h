// SPDX-License-Identifier: Apache-2.0
// A method's mean picture, and bounds on the mean's random error.
#pragma once
#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::random_scenes {

/// Means over independent values, for every pixel and, as the last entry, for the whole picture. A value is a
/// sample if the scene uses independent sampling; otherwise it is the mean of the samples of one scrambling.
struct Estimates {
  double count = 0;
  std::vector<glm::dvec4> mean, variance, least, most;  ///< variance of one value
};

/// Number of pictures with different seeds, and number of samples in each.
struct Effort {
  int seeds, samples;
};

/// Renders with the scene's method. `round` selects the seeds.
Estimates estimate(const std::shared_ptr<const Volume>& volume, const Scene& scene, Effort effort,
                   std::uint32_t round);

/// Cost of one sample of the whole picture, fetches and other work, in units of a fetch: the same on every
/// machine except for quadrature, where it depends on the processor's vector instructions.
double costOf(const std::shared_ptr<const Volume>& volume, const Scene& scene);

/// Bound on the error of a mean of `count` values between 0 and `range` with this sample variance (Maurer and
/// Pontil, "Empirical Bernstein bounds and sample variance penalization", 2009, theorem 4). It is exceeded
/// with a probability of at most 4 exp(-logTerm), both sides together.
double empiricalBernstein(double variance, double range, double count, double logTerm);

/// Upper bound of any component of one sample.
double largestSample(const Scene& scene);

}  // namespace scolopax::random_scenes
