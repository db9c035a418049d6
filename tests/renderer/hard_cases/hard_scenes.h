// SPDX-License-Identifier: Apache-2.0
// Shared by the hard cases: fields with some structure, views, and comparisons.
#pragma once
#include <initializer_list>

#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax::test {

/// The size of small volumes, with a different number of voxels along every axis.
inline constexpr glm::ivec3 kSmallDims(7, 6, 5);
/// Pictures that are compared with the reference: pixels along a side, and samples per pixel.
inline constexpr int kSide = 20, kSamples = 200;

/// A lumpy field between 0 and 1, different for every `kind`.
inline auto lumps(int kind = 0) {
  return [kind](int x, int y, int z) {
    return 0.5 + 0.5 * std::sin(0.9 * x + kind) * std::cos(1.3 * y - 0.5 * kind) * std::sin(0.7 * z + 1.1);
  };
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

/// Compares both kinds of quadrature with optical thickness `depth` in every pixel, where they are exact.
inline void expectMarchedThickness(const std::shared_ptr<const Volume>& volume, Scene scene, double depth,
                                   std::initializer_list<double> steps) {
  for (const Method method : {Method::raymarch, Method::hybrid})
    for (const double step : steps) {
      scene.method = method;
      scene.step = step;
      for (const glm::vec4& pixel : renderSamples(volume, scene, 4).pixels)
        ASSERT_NEAR(pixel.a, -std::expm1(-depth), 1e-4 * depth) << nameOf(method) << ' ' << step;
    }
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

/// One colour per channel, because colours that change within a cell hide each other, and little extinction.
inline Scene thin(Scene scene, double factor) {
  for (ChannelAppearance& channel : scene.channels) {
    channel.density *= factor;
    channel.color = {channel.color.front()};
  }
  return scene;
}

}  // namespace scolopax::test
