// SPDX-License-Identifier: Apache-2.0
// Tests whether the expected value of an analog picture is the reference's: three tests, each with a stated
// false-alarm probability. Seeds are fixed, so a test that passes once passes always.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "renderer/data/image.h"
#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "tests/support/volumes.h"

namespace scolopax::test {

/// Factor for every number of samples here: the environment variable SCOLOPAX_STATISTICS, 0.01 to 1000; 1 if
/// unset. With less than 1, tests that must detect something skip: they need their samples.
inline double statisticsFactor() {
  static const double factor = [] {
    const char* text = std::getenv("SCOLOPAX_STATISTICS");
    return text ? std::clamp(std::atof(text), 0.01, 1000.0) : 1.0;
  }();
  return factor;
}
inline int timesFactor(int samples) { return std::max(1, int(std::lround(samples * statisticsFactor()))); }
/// Whether tests use all combinations of the settings that they vary: if the environment variable
/// SCOLOPAX_COMBINATIONS is "all", as in `make check`. Otherwise they cover all pairs.
inline bool allCombinations() {
  const char* text = std::getenv("SCOLOPAX_COMBINATIONS");
  return text && std::strcmp(text, "all") == 0;
}

/// A picture of the scene with `samples` times the factor samples per pixel.
inline Image renderSamples(const std::shared_ptr<const Volume>& volume, const Scene& scene, int samples,
                           int threads = 0) {
  const auto renderer = makeCpuRenderer(volume, threads);
  renderer->setScene(scene);
  const std::atomic<bool> cancel = false;
  for (int i = 0; i < timesFactor(samples); ++i) renderer->renderSample(cancel);
  return renderer->image();
}

/// The same with one method and samples that are independent of each other.
inline Image renderAnalog(const std::shared_ptr<const Volume>& volume, Scene scene, Method method,
                          int samples, int threads = 0) {
  scene.method = method;
  scene.sampling = Sampling::independent;
  return renderSamples(volume, scene, samples, threads);
}

inline bool sameBits(const Image& a, const Image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(a.pixels[0])) == 0;
}

/// A picture with one value everywhere: the closed form of a scene whose pixels are all the same.
inline reference::ReferenceImage flat(const Scene& scene, glm::dvec4 value) {
  const std::size_t pixels = std::size_t(scene.width) * std::size_t(scene.height);
  return {{scene.width, scene.height, std::vector<glm::vec4>(pixels, glm::vec4(value))}, {}, 0};
}

/// Compares a picture of `samples` times the factor samples with the reference. Every sample must be 0 or 1
/// in every component (the colours of the scene's channels have only zeros and ones): the mean is then
/// binomial, and the reference gives its variance.
///  - The largest deviation, by Bernstein's inequality, which holds for any distribution on [0,1], over all
///    pixels and components together: false-alarm probability 1e-9.
///  - The mean deviation of each component, which reveals a small bias of the whole picture: 6 sigma, 1e-8.
///  - The mean squared deviation, which reveals a bias whose sign changes over the picture: 6 sigma. The
///    components of a pixel may be identical (alpha and the only colour).
inline ::testing::AssertionResult isUnbiased(const Image& found, int samples,
                                             const reference::ReferenceImage& expected) {
  const double n = timesFactor(samples);
  const std::size_t pixels = found.pixels.size();
  const double logTerm = std::log(2.0 * 4.0 * double(pixels) / 1e-9);
  const double tolerance = expected.maximumRayError + 1e-6;
  double squares = 0, variance = 0;
  std::vector<double> spread(
      pixels);  // standard deviation of a pixel's squared deviations, as if fully correlated
  for (int c = 0; c < 4; ++c) {
    double sum = 0, sumVariance = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double p = std::clamp(double(expected.image.pixels[i][c]), 0.0, 1.0), pq = p * (1 - p);
      const double error = expected.standardError.empty() ? 0.0 : double(expected.standardError[i][c]);
      const double d = double(found.pixels[i][c]) - p;
      const double bound = (logTerm / 3 + std::sqrt(logTerm * logTerm / 9 + 2 * n * pq * logTerm)) / n;
      if (!(std::abs(d) <= bound + tolerance + 6 * error))
        return ::testing::AssertionFailure()
               << "pixel " << i << " component " << c << ": found " << found.pixels[i][c] << ", expected "
               << p << " within " << bound;
      const double v = pq / n + error * error;
      sum += d;
      sumVariance += v;
      squares += d * d;
      variance += v;
      spread[i] += std::sqrt(2 * v * v + pq * std::max(0.0, 1 - 6 * pq) / (n * n * n));
    }
    if (!(std::abs(sum) <= 6 * std::sqrt(sumVariance) + double(pixels) * tolerance))
      return ::testing::AssertionFailure() << "component " << c << ": mean deviation " << sum / double(pixels)
                                           << " is " << sum / std::sqrt(sumVariance) << " sigma";
  }
  double varianceOfSquares = 0;
  for (const double s : spread) varianceOfSquares += s * s;
  if (variance > 0 && std::abs(squares - variance) >
                          6 * std::sqrt(varianceOfSquares) + 4 * double(pixels) * tolerance * tolerance)
    return ::testing::AssertionFailure()
           << "mean squared deviation is " << squares / variance << " of what binomial noise gives, "
           << (squares - variance) / std::sqrt(varianceOfSquares) << " sigma away";
  return ::testing::AssertionSuccess();
}

/// Every tracker against a reference picture of the scene.
inline void expectTrackersMatch(const reference::ReferenceImage& expected,
                                const std::shared_ptr<const Volume>& volume, const Scene& scene,
                                int samples) {
  for (const Method method : kTrackers)
    EXPECT_TRUE(isUnbiased(renderAnalog(volume, scene, method, samples), samples, expected))
        << nameOf(method);
}
inline void expectTrackersMatchReference(const std::shared_ptr<const Volume>& volume, const Scene& scene,
                                         int samples, int samplesPerAxis = 4) {
  expectTrackersMatch(reference::renderReference(*volume, scene, samplesPerAxis), volume, scene, samples);
}

}  // namespace scolopax::test
