// SPDX-License-Identifier: Apache-2.0
// Shared by the hard cases: colours of zeros and ones, fields with some structure, views, and comparisons.
#pragma once
#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax::test {

constexpr glm::dvec3 kRed(1, 0, 0), kGreen(0, 1, 0), kBlue(0, 0, 1), kWhite(1, 1, 1);

/// Opacity rises from 0 at lo to 1 at hi.
inline ChannelAppearance ramp(double lo, double hi, double density, glm::dvec3 color = kWhite) {
  ChannelAppearance a;
  a.rangeLo = lo;
  a.rangeHi = hi;
  a.density = density;
  a.color = {{0, color}};
  return a;
}

/// A lumpy field between 0 and 1, different for every `kind`.
inline auto lumps(int kind = 0) {
  return [kind](int x, int y, int z) {
    return 0.5 + 0.5 * std::sin(0.9 * x + kind) * std::cos(1.3 * y - 0.5 * kind) * std::sin(0.7 * z + 1.1);
  };
}

/// A picture with one value everywhere: the closed form of a scene whose pixels are all the same.
inline reference::ReferenceImage flat(const Scene& scene, glm::dvec4 value) {
  const std::size_t pixels = std::size_t(scene.width) * std::size_t(scene.height);
  return {{scene.width, scene.height, std::vector<glm::vec4>(pixels, glm::vec4(value))}, {}, 0};
}

/// Compares every tracker, and the reference, with optical thickness `depth` of one colour in every pixel.
inline void expectThickness(const std::shared_ptr<const Volume>& volume, Scene scene, double depth,
                            glm::dvec3 color, int samples) {
  const double alpha = -std::expm1(-depth);
  const auto expected = flat(scene, glm::dvec4(color, 1) * alpha);
  expectTrackersMatch(expected, volume, scene, samples);
  scene.filter = PixelFilter::point;
  const auto reference = reference::renderReference(*volume, scene, 1);
  for (const glm::vec4& pixel : reference.image.pixels)
    ASSERT_NEAR(pixel.a / alpha, 1, 1e-5 + reference.maximumRayError / alpha);
}

/// Compares every tracker with the reference, with rays through pixel centres.
inline void expectReference(const std::shared_ptr<const Volume>& volume, Scene scene, int samples) {
  scene.filter = PixelFilter::point;
  expectTrackersMatchReference(volume, scene, samples, 1);
}

/// A perspective view; the caller still has to set the channels.
inline Scene viewFrom(const Volume& volume, glm::dvec3 eye, glm::dvec3 target, double fovY, int side) {
  Scene scene;
  scene.camera.eye = eye;
  scene.camera.target = target;
  scene.camera.up = {0.1, 1, 0.2};
  scene.camera.fovY = fovY;
  scene.width = scene.height = side;
  scene.channels.resize(volume.channels().size());
  return scene;
}

inline RenderStats statsOf(const std::shared_ptr<const Volume>& volume, Scene scene, Method method,
                           int samples) {
  scene.method = method;
  const auto renderer = makeCpuRenderer(volume, 0);
  renderer->countCosts();
  renderer->setScene(scene);
  const std::atomic<bool> never = false;
  for (int i = 0; i < samples; ++i) renderer->renderSample(never);
  return renderer->stats();
}

/// Largest difference of quadrature from the reference over pixels and components, beyond the error that the
/// reference claims.
inline double largestError(const std::shared_ptr<const Volume>& volume, Scene scene, double step = 0,
                           int samples = 1) {
  scene.filter = PixelFilter::point;
  scene.method = Method::raymarch;
  scene.step = step;
  const auto expected = reference::renderReference(*volume, scene, 1);
  const Image found = renderSamples(volume, scene, samples);
  double largest = 0;
  for (std::size_t i = 0; i < found.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c)
      largest = std::max(largest, std::abs(double(found.pixels[i][c]) - double(expected.image.pixels[i][c])));
  return largest - expected.maximumRayError;
}

/// One colour per channel, as colours that change within a cell hide each other, and little extinction.
inline Scene thin(Scene scene, double factor) {
  for (ChannelAppearance& channel : scene.channels) {
    channel.density *= factor;
    channel.color = {channel.color.front()};
  }
  return scene;
}

}  // namespace scolopax::test
