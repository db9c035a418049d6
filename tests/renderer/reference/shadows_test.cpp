// SPDX-License-Identifier: Apache-2.0
// Shadows in the reference: closed forms in homogeneous boxes, and tiny steps for a scene with all features.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

constexpr double kTolerance = 1e-4;  // the integrator's tolerance with light

Light pointAt(const glm::dvec3& position) { return {LightType::point, position, glm::dvec3(1), 1}; }

/// A box 8 long from z = -0.5 on, seen along +z at (2, 3); extinction 0.35, white, ambient 0.2.
struct Slab {
  static constexpr double sigma = 0.35, length = 8, depth = sigma * length, ambient = 0.2;
  Volume volume =
      makeVolume(gridOf({8, 8, 8}), std::vector<VoxelFunction>(2, [](int, int, int) { return 1; }));
  Scene scene = makeScene({solid(sigma, glm::dvec3(1)), solid(0, glm::dvec3(1))});
  Slab() {
    scene.shadows = true;
    for (ChannelAppearance& channel : scene.channels) channel.material.ambient = ambient;
  }
  glm::dvec4 trace(double fromZ = -9) const {
    return traceReference(volume, scene, {2, 3, fromZ}, {0, 0, 1}).rgba;
  }
  void expectGray(double lit) const {
    const glm::dvec4 found = trace();
    const double alpha = 1 - std::exp(-depth);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], ambient * alpha + (1 - ambient) * lit, kTolerance);
    EXPECT_NEAR(found.a, alpha, 1e-7);
  }
};

TEST(ReferenceShadows, LightFromTheFrontIsDimmedOnItsWayToo) {
  Slab slab;
  slab.scene.lights = {directional({0, 0, 5})};
  slab.expectGray((1 - std::exp(-2 * Slab::depth)) / 2);
}

TEST(ReferenceShadows, LightFromBehindIsTheDarkerTheNearer) {
  Slab slab;
  slab.scene.lights = {directional({0, 0, -5})};
  slab.expectGray(Slab::depth * std::exp(-Slab::depth));
}

TEST(ReferenceShadows, LightFromTheSideIsDimmedByTheWayFromThatSide) {
  Slab slab;
  const double alpha = 1 - std::exp(-Slab::depth);
  slab.scene.lights = {directional({1, 0, 0})};  // from -x: 2.5 units away
  slab.expectGray(alpha * std::exp(-Slab::sigma * 2.5));
  slab.scene.lights = {directional({-1, 0, 0})};  // from +x: 5.5
  slab.expectGray(alpha * std::exp(-Slab::sigma * 5.5));
  slab.scene.lights = {directional({0, 3, 0})};  // from -y: 3.5
  slab.expectGray(alpha * std::exp(-Slab::sigma * 3.5));
}

TEST(ReferenceShadows, AHeadlightIsDimmedBetweenTheEyeAndThePointOnly) {
  Slab slab;
  slab.expectGray((1 - std::exp(-2 * Slab::depth)) / 2);  // no lights: one headlight
  const double rest = Slab::sigma * 5, alpha = 1 - std::exp(-rest);
  const glm::dvec4 inside = slab.trace(2.5);  // the eye 3 units inside
  EXPECT_NEAR(inside.r, 0.2 * alpha + 0.8 * (1 - std::exp(-2 * rest)) / 2, kTolerance);
}

TEST(ReferenceShadows, APointLightIsDimmedBetweenItAndThePointOnly) {
  Slab slab;
  slab.scene.lights = {pointAt({2, 3, 2.5})};  // on the ray, 3 units inside
  const double before = 3 * Slab::sigma;
  slab.expectGray(before * std::exp(-before) +
                  std::exp(before) * (std::exp(-2 * before) - std::exp(-2 * Slab::depth)) / 2);
  slab.scene.lights = {pointAt({2, 3, -4})};  // outside, in front
  slab.expectGray((1 - std::exp(-2 * Slab::depth)) / 2);
}

TEST(ReferenceShadows, ColoursOfLightsAreDimmedSeparately) {
  Slab slab;
  slab.scene.lights = {directional({0, 0, 1}, {1, 0, 0}), directional({1, 0, 0}, {3, 0, 2}, 0.5)};
  const double alpha = 1 - std::exp(-Slab::depth);
  const double front = (1 - std::exp(-2 * Slab::depth)) / 2, side = alpha * std::exp(-Slab::sigma * 2.5);
  const glm::dvec4 found = slab.trace();
  EXPECT_NEAR(found.r, 0.2 * alpha + 0.8 * (front + 1.5 * side) / 2.5, kTolerance);
  EXPECT_NEAR(found.g, alpha, kTolerance);  // no green light: nothing that could be shadowed
  EXPECT_NEAR(found.b, 0.2 * alpha + 0.8 * side, kTolerance);
}

/// Uses a second channel of extinction 0.6.
TEST(ReferenceShadows, OccludersAreBlendedAsTheSceneIs) {
  Slab slab;
  slab.scene.lights = {directional({1, 0, 0})};
  slab.scene.channels[1].density = 0.6;
  slab.scene.channels[0].color = {{0, {1, 0, 0}}};
  slab.scene.channels[1].color = {{0, {0, 1, 0}}};
  const auto dim = [](double sigma) { return 0.2 + 0.8 * std::exp(-sigma * 2.5); };
  const auto alpha = [](double sigma) { return 1 - std::exp(-sigma * 8); };
  const auto expectColor = [&](BlendMode mode, double red, double green) {
    slab.scene.blend = mode;
    const glm::dvec4 found = slab.trace();
    EXPECT_NEAR(found.r, red, kTolerance) << nameOf(mode);
    EXPECT_NEAR(found.g, green, kTolerance) << nameOf(mode);
  };
  expectColor(BlendMode::density, alpha(0.95) * dim(0.95) * 0.35 / 0.95,
              alpha(0.95) * dim(0.95) * 0.6 / 0.95);
  expectColor(BlendMode::max, 0, alpha(0.6) * dim(0.6));
  expectColor(BlendMode::mix, alpha(0.6) * dim(0.6) * 0.35 / 0.6, alpha(0.6) * dim(0.6));
  expectColor(BlendMode::composite, alpha(0.35) * dim(0.35), alpha(0.6) * dim(0.6));
}

TEST(ReferenceShadows, HiddenChannelsThrowNone) {
  Slab slab;
  slab.scene.lights = {directional({1, 0, 0})};
  slab.scene.channels[1].density = 5;
  slab.scene.channels[1].visible = false;
  slab.expectGray((1 - std::exp(-Slab::depth)) * std::exp(-Slab::sigma * 2.5));
}

TEST(ReferenceShadows, LightThatNothingIsInTheWayOfIsNotDimmed) {
  // So thin that every visibility is 1 within a millionth.
  const Volume volume = rampAlongX({8, 8, 8});
  Scene scene = makeScene({ramp(0, 7, 1e-8, {0.9, 0.5, 0.2})});
  scene.lights = {directional({-1, 0.4, 0.2}, {1, 0.5, 0}, 2), pointAt({20, 3, 4}), Light{}};
  for (const bool shading : {false, true}) {
    scene.shading = shading;
    scene.shadows = false;
    const glm::dvec4 without = traceReference(volume, scene, {20, 5, 3}, {-1, -0.1, 0.05}).rgba;
    scene.shadows = true;
    const glm::dvec4 with = traceReference(volume, scene, {20, 5, 3}, {-1, -0.1, 0.05}).rgba;
    ASSERT_GT(without.r, 1e-9);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(with[c] / without[c], 1, 1e-6) << shading;
  }
}

TEST(ReferenceShadows, DoNotReachWhatIsFullyAmbient) {
  Slab slab;
  slab.scene.lights = {directional({1, 0.2, -0.3})};
  for (ChannelAppearance& channel : slab.scene.channels) channel.material = {1, 0, 0, 1};
  const double alpha = 1 - std::exp(-Slab::depth);
  for (const bool shading : {false, true}) {
    slab.scene.shading = shading;
    EXPECT_NEAR(slab.trace().r, alpha, 1e-7);
  }
}

TEST(ReferenceShadows, AnOpaqueWallBlackensWhatIsBehindItAndNothingElse) {
  // A wall at x = 3, for y < 4, between the light and the ray at x = 6.
  const Volume volume = makeVolume(gridOf({8, 8, 8}), {[](int i, int j, int) { return i == 3 && j < 4; },
                                                       [](int i, int, int) { return i > 5; }});
  Scene scene = makeScene({ramp(0, 1, 1e5), solid(0.2, glm::dvec3(1))});
  scene.channels[1].opacity = {{0.5, 0}, {0.5, 1}};
  scene.channels[1].material.ambient = 0;
  scene.shadows = true;
  scene.lights = {directional({1, 0, 0})};
  const auto seenAt = [&](double y) { return traceReference(volume, scene, {6, y, -9}, {0, 0, 1}).rgba; };
  EXPECT_NEAR(seenAt(2).r, 0, 1e-6);
  // Between the light and the ray is matter from x = 5.5 on, where the value exceeds 1/2.
  EXPECT_NEAR(seenAt(6).r, (1 - std::exp(-1.6)) * std::exp(-0.1), kTolerance);
  EXPECT_NEAR(seenAt(2).a, seenAt(6).a, 1e-7);
}

/// Figure 3 with shading and shadows, in tiny steps: extinctions are known in closed form, gradients are
/// constant.
struct LitFigure3 : Figure3 {
  const double kRange = n - 1;
  LitFigure3() {
    scene.shading = scene.shadows = true;
    scene.channels[0].material = {0.1, 0.9, 0.5, 5};
    scene.channels[1].material = {0.4, 0.5, 0.1, 20};
    scene.channels[2].weight = 0.5;
    scene.lights = {directional({1, 2, -1}, {1, 0.8, 0.6}, 1.2), pointAt({3, 9, 2}), Light{}};
    scene.lights[2].intensity = 0.3;
  }

  static double blended(BlendMode mode, const glm::dvec3& sigma, int channel) {
    if (mode == BlendMode::density) return sigma.x + sigma.y + sigma.z;
    return mode == BlendMode::composite ? sigma[channel] : std::max({sigma.x, sigma.y, sigma.z});
  }
  /// t at which a ray enters the box (with `entry`) or leaves it.
  static double passes(const glm::dvec3& origin, const glm::dvec3& direction, bool entry) {
    double begin = 0, end = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (-0.5 - origin[axis]) / direction[axis], b = (7.5 - origin[axis]) / direction[axis];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    return entry ? begin : end;
  }
  double visible(BlendMode mode, const glm::dvec3& p, const glm::dvec3& l, double distance,
                 int channel) const {
    const double end = std::min(passes(p, l, false), distance);
    double depth = 0;
    for (int i = 0; i < 300; ++i)
      depth += blended(mode, sigma(p + (i + 0.5) * end / 300 * l), channel) * end / 300;
    return std::exp(-depth);
  }
  /// Radiance of one channel at p.
  glm::dvec3 lit(BlendMode mode, int channel, const glm::dvec3& p, const glm::dvec3& eye) const {
    const glm::dvec3 gradients[3] = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const Material& m = scene.channels[std::size_t(channel)].material;
    const glm::dvec3 v = glm::normalize(eye - p), color = scene.channels[std::size_t(channel)].color[0].color;
    glm::dvec3 normal = gradients[channel], diffuse(0), specular(0), all(0), seen(0);
    if (glm::dot(normal, v) < 0) normal = -normal;
    for (const Light& light : scene.lights) {
      glm::dvec3 l = eye - p;
      double distance = glm::length(l);
      if (light.type == LightType::directional) l = -light.vector, distance = 1e9;
      if (light.type == LightType::point) l = light.vector - p, distance = glm::length(l);
      l = glm::normalize(l);
      const glm::dvec3 intensity = light.color * light.intensity;
      const glm::dvec3 reaching = intensity * visible(mode, p, l, distance, channel);
      all += intensity;
      seen += reaching;
      diffuse += reaching * std::max(glm::dot(normal, l), 0.0);
      specular += reaching * std::pow(std::max(glm::dot(normal, glm::normalize(l + v)), 0.0), m.shininess);
    }
    const double g = 1 / kRange, s = 1 - (1 - g) * (1 - g);
    return color * ((1 - s) * (m.ambient + (1 - m.ambient) * (seen / all)) +
                    s * (m.ambient + m.diffuse * diffuse)) +
           s * m.specular * specular;
  }
  glm::dvec3 march(BlendMode mode, const glm::dvec3& origin, const glm::dvec3& direction) const {
    const double begin = passes(origin, direction, true), end = passes(origin, direction, false);
    constexpr int kSteps = 2000;
    const double dt = (end - begin) / kSteps;
    glm::dvec3 color(0), depths(0);
    for (int i = 0; i < kSteps; ++i) {
      const glm::dvec3 p = origin + (begin + (i + 0.5) * dt) * direction, s = sigma(p);
      for (int channel = 0; channel < 3; ++channel) {
        const double extinction = blended(mode, s, channel);
        double share = s[channel];
        if (mode == BlendMode::max && s[channel] < extinction) share = 0;
        if (mode == BlendMode::mix) share *= scene.channels[std::size_t(channel)].weight;
        if (share > 0)
          color +=
              std::exp(-depths[channel] - 0.5 * extinction * dt) * share * dt * lit(mode, channel, p, origin);
        depths[channel] += extinction * dt;
      }
    }
    return color;
  }
};

TEST(ReferenceShadows, Figure3WithShadingShadowsAndThreeLightsMatchesTinySteps) {
  LitFigure3 figure;
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-2, 1, 1.5)),
                   origin = glm::dvec3(3.4, 3.7, 3.1) - 20.0 * direction;
  for (const BlendMode mode : {BlendMode::density, BlendMode::max, BlendMode::mix, BlendMode::composite}) {
    figure.scene.blend = mode;
    const glm::dvec3 expected = figure.march(mode, origin, direction);
    const RayResult found = traceReference(figure.volume, figure.scene, origin, direction);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.rgba[c], expected[c], 3e-4) << nameOf(mode) << ' ' << c;
    EXPECT_LE(found.error, 2 * kTolerance) << nameOf(mode);
  }
}

}  // namespace
}  // namespace scolopax::reference
