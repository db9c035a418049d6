// SPDX-License-Identifier: Apache-2.0
// Tests whether the expected value of replicates is the reference's, and whether two methods have the same
// expected value: per pixel and component, per component over the picture, and over the picture's structure.
//
// False-alarm probabilities, each for one comparison (one method in one scene, or one pair of methods):
//  - pixels: 1e-8 over all pixels and components together, by Bernstein's inequality. The variance of a
//    sample is bounded by m (M - m), which holds for any distribution on [0, M] with mean m.
//    Low-discrepancy points are assumed to have no larger variance than independent ones;
//  - components: Student's t with 31 degrees of freedom beyond 8: 5e-9 each, 2e-8 together. Pixels of a
//    replicate may depend on each other in any way;
//  - structure: the mean inner product of the deviations of two different replicates; its expected value is
//    the squared length of the bias, without the noise. In units of its estimated standard deviation it is at
//    worst a sum of squares of k normal numbers, where k is the number of independent components of the
//    picture: beyond 8, 1e-10 for k = 144 and 1e-6 for k = 12.
// Together below 2e-6, and over all 1300 comparisons of `make check` below 0.3 %. Seeds are fixed: a test
// that passes once passes always.
#pragma once
#include <array>
#include <string>

#include "tests/support/replicates.h"

namespace scolopax::test {

/// The largest value that a sample can have, per component: the largest radiance of one channel or, where a
/// sample can show several channels, the sum over all.
inline glm::dvec4 largestSample(const Scene& scene) {
  glm::dvec3 light(0), largest(0), sum(0);
  for (const Light& l : scene.lights) light += l.color * l.intensity;
  if (scene.lights.empty()) light = glm::dvec3(1);
  for (const ChannelAppearance& a : scene.channels) {
    glm::dvec3 color(0);
    for (const ColorKnot& knot : a.color) color = glm::max(color, knot.color);
    glm::dvec3 ofSurfaces = a.peaks == Peaks::off ? glm::dvec3(0) : color;
    for (const Isovalue& isovalue : a.isovalues)
      ofSurfaces = glm::max(ofSurfaces, isovalue.color.value_or(color));
    const auto lit = [&](const glm::dvec3& c) {
      if (!scene.shading) return c;
      return c * glm::max(glm::dvec3(1), a.material.ambient + a.material.diffuse * light) +
             a.material.specular * light;
    };
    glm::dvec3 shown = lit(color);
    if (scene.blend == BlendMode::mix) shown *= a.weight;
    shown = glm::max(shown, ofSurfaces == glm::dvec3(0) ? ofSurfaces : lit(ofSurfaces));
    largest = glm::max(largest, shown);
    sum += shown;
  }
  const bool several = scene.blend == BlendMode::mix || scene.blend == BlendMode::composite;
  return glm::dvec4(several ? sum : largest, 1);
}

namespace detail {

/// Deviations of replicates from the values with which they are compared; their expected value is 0 if both
/// agree.
struct Deviations {
  std::vector<std::vector<glm::dvec4>> ofReplicate;
  std::vector<glm::dvec4> mean;
  std::vector<glm::dvec4> spread;  // upper bound of the standard deviation of one sample
};

/// Tests the components and the structure. `slack`: possible error of the expected value itself.
inline ::testing::AssertionResult areNoise(const Deviations& d, double slack) {
  const std::size_t pixels = d.mean.size();
  const double n = double(d.ofReplicate.size());
  for (int c = 0; c < 4; ++c) {
    double sum = 0, squares = 0;
    for (const auto& replicate : d.ofReplicate) {
      double z = 0;
      for (std::size_t i = 0; i < pixels; ++i) z += replicate[i][c] / double(pixels);
      sum += z;
      squares += z * z;
    }
    const double mean = sum / n;
    const double sigma = std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1));
    if (!(std::abs(mean) <= 8 * sigma + slack))
      return ::testing::AssertionFailure() << "component " << c << ": the picture's mean is off by " << mean
                                           << ", " << mean / sigma << " standard errors";
  }
  // Inner products in units of each component's noise bound. Components almost without noise are skipped.
  std::vector<glm::dvec4> weight(pixels, glm::dvec4(0));
  double slackSquared = 0;
  for (std::size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < 4; ++c) {
      if (!(d.spread[i][c] > 1e-3)) continue;  // the other two tests cover these
      weight[i][c] = 1 / (d.spread[i][c] * d.spread[i][c]);
      slackSquared += slack * slack * weight[i][c];
    }
  double sum = 0, squares = 0;
  int pairs = 0;
  for (std::size_t r = 0; r < d.ofReplicate.size(); ++r)
    for (std::size_t s = 0; s < r; ++s) {
      double product = 0;
      for (std::size_t i = 0; i < pixels; ++i) {
        const glm::dvec4 p = d.ofReplicate[r][i] * d.ofReplicate[s][i] * weight[i];
        product += p.x + p.y + p.z + p.w;
      }
      sum += product;
      squares += product * product;
      ++pairs;
    }
  const double found = sum / pairs, spread = std::sqrt(squares) / pairs;
  if (found - slackSquared > 8 * spread)
    return ::testing::AssertionFailure()
           << "deviations of different replicates are alike: " << found / spread << " standard deviations";
  return ::testing::AssertionSuccess();
}

/// Bernstein's bound on the error of the mean of n samples in [0, `largest`] with expected value m. It is
/// exceeded with a probability of at most 2 exp(-logTerm).
inline double bernstein(double m, double largest, double n, double logTerm) {
  const double variance = std::max(0.0, m * (largest - m));
  const double a = logTerm * largest / 3;
  return (a + std::sqrt(a * a + 2 * n * variance * logTerm)) / n;
}

}  // namespace detail

namespace detail {

inline Deviations deviationsFrom(const reference::ReferenceImage& expected, const Replicates& found,
                                 const Scene& scene) {
  const std::size_t pixels = expected.image.pixels.size();
  const glm::dvec4 largest = largestSample(scene);
  Deviations d;
  d.mean.assign(pixels, glm::dvec4(0));
  d.spread = d.mean;
  for (const Image& picture : found.pictures) {
    std::vector<glm::dvec4>& deviation = d.ofReplicate.emplace_back(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      deviation[i] = glm::dvec4(picture.pixels[i]) - glm::dvec4(expected.image.pixels[i]);
      d.mean[i] += deviation[i] / double(found.pictures.size());
    }
  }
  for (std::size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < 4; ++c) {
      const double m = std::clamp(double(expected.image.pixels[i][c]), 0.0, largest[c]);
      d.spread[i][c] = std::sqrt(m * (largest[c] - m));
    }
  return d;
}

}  // namespace detail

/// Whether the expected value of `found` is the picture `expected`.
inline ::testing::AssertionResult haveMean(const Replicates& found, const Scene& scene,
                                           const reference::ReferenceImage& expected) {
  const std::size_t pixels = expected.image.pixels.size();
  const double n = double(found.pictures.size()) * found.samples;
  const double logTerm = std::log(2.0 * 4.0 * double(pixels) / 1e-8);
  const glm::dvec4 largest = largestSample(scene);
  // The reference's bound on its own error, and the rounding of pixels and weights in float.
  const double slack = expected.maximumRayError + 2e-6;
  const detail::Deviations d = detail::deviationsFrom(expected, found, scene);
  for (std::size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < 4; ++c) {
      const double m = std::clamp(double(expected.image.pixels[i][c]), 0.0, largest[c]);
      const double bound = detail::bernstein(m, largest[c], n, logTerm);
      if (!(std::abs(d.mean[i][c]) <= bound + slack))
        return ::testing::AssertionFailure()
               << "pixel " << i << " component " << c << ": off by " << d.mean[i][c] << " from " << m
               << ", within " << bound << " expected";
    }
  return detail::areNoise(d, slack);
}

/// The same for samples of unknown distribution, whose noise is smaller than the largest possible. Pixels:
/// Student's t with 31 degrees of freedom beyond 10, 3e-11 for each component. `slack` is allowed in
/// addition.
inline ::testing::AssertionResult haveMeanBySpread(const Replicates& found, const Scene& scene,
                                                   const reference::ReferenceImage& expected, double slack) {
  const double n = double(found.pictures.size());
  const detail::Deviations d = detail::deviationsFrom(expected, found, scene);
  for (std::size_t i = 0; i < d.mean.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      double squares = 0;
      for (const auto& replicate : d.ofReplicate) squares += std::pow(replicate[i][c] - d.mean[i][c], 2);
      const double sigma = std::sqrt(squares / (n - 1) / n);
      if (!(std::abs(d.mean[i][c]) <= 10 * sigma + slack))
        return ::testing::AssertionFailure()
               << "pixel " << i << " component " << c << ": off by " << d.mean[i][c] << ", "
               << d.mean[i][c] / sigma << " standard errors";
    }
  return detail::areNoise(d, slack);
}

/// Whether two methods have the same expected value. Replicates of one seed share random numbers, so
/// differences are taken per seed. However the two depend on each other, the standard deviation of a
/// difference is at most twice that of one of them.
inline ::testing::AssertionResult haveSameMean(const Replicates& a, const Replicates& b, const Scene& scene) {
  const std::size_t pixels = a.pictures[0].pixels.size(), replicates = a.pictures.size();
  const double n = double(replicates) * a.samples;
  const double logTerm = std::log(2.0 * 4.0 * double(pixels) / 1e-8);
  const glm::dvec4 largest = largestSample(scene);
  detail::Deviations d;
  d.mean.assign(pixels, glm::dvec4(0));
  d.spread = d.mean;
  std::vector<glm::dvec4> middle = d.mean;
  for (std::size_t r = 0; r < replicates; ++r) {
    std::vector<glm::dvec4>& deviation = d.ofReplicate.emplace_back(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const glm::dvec4 p(a.pictures[r].pixels[i]), q(b.pictures[r].pixels[i]);
      deviation[i] = p - q;
      d.mean[i] += deviation[i] / double(replicates);
      middle[i] += (p + q) / (2.0 * double(replicates));
    }
  }
  for (std::size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < 4; ++c) {
      const double m = middle[i][c];
      d.spread[i][c] = 2 * std::sqrt(std::max(0.0, m * (largest[c] - m)));
      const double bound = 2 * detail::bernstein(m, largest[c], n, logTerm);
      if (!(std::abs(d.mean[i][c]) <= bound))
        return ::testing::AssertionFailure()
               << "pixel " << i << " component " << c << ": differ by " << d.mean[i][c] << " at " << m
               << ", within " << bound << " expected";
    }
  return detail::areNoise(d, 2e-6);
}

/// Compares every tracker with the reference, with rays through pixel centres; samples may have any value.
inline void expectUnbiased(const std::shared_ptr<const Volume>& volume, Scene scene) {
  scene.filter = PixelFilter::point;
  const auto expected = reference::renderReference(*volume, scene, 1);
  for (const Method method : kTrackers)
    EXPECT_TRUE(haveMean(replicate(volume, scene, method), scene, expected)) << nameOf(method);
}

}  // namespace scolopax::test
