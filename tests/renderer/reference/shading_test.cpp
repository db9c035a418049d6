// SPDX-License-Identifier: Apache-2.0
// Gradient shading in the reference. In a linear field of constant opacity the radiance is the same
// everywhere, so that the colour of a ray is its alpha times the formula, which is written independently
// here.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "renderer/core/error.h"
#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

const glm::dvec3 kColor(0.8, 0.4, 0.2);
const Material kMaterial{0.1, 0.6, 0.35, 7};

/// A field of value dot(a, world), on a grid with the given columns around the origin; opacity does not
/// depend on the value.
struct LinearField {
  glm::dvec3 a{1, 0, 0};
  glm::dmat3 columns{1.0};
  double range = 1;
  Scene scene = makeScene({solid(0.3, kColor)});

  LinearField() {
    scene.channels[0].material = kMaterial;
    scene.shading = true;
  }
  Volume volume() const {
    Grid grid;
    grid.dims = {6, 5, 4};
    grid.worldFromVoxel = glm::dmat4(columns);
    grid.worldFromVoxel[3] = glm::dvec4(columns * glm::dvec3(-2.5, -2, -1.5), 1);
    return makeVolume(grid, {[&](int i, int j, int k) {
                        return glm::dot(a, glm::dvec3(grid.worldFromVoxel * glm::dvec4(i, j, k, 1)));
                      }});
  }
  /// The radiance, which is colour over alpha.
  glm::dvec3 seenAlong(const glm::dvec3& direction) {
    scene.channels[0].rangeLo = 5;
    scene.channels[0].rangeHi = 5 + range;
    const RayResult found = traceReference(volume(), scene, -20.0 * direction, direction);
    EXPECT_GT(found.rgba.a, 0.1);
    return glm::dvec3(found.rgba) / found.rgba.a;
  }
};

void expectNear(const glm::dvec3& found, const glm::dvec3& expected, double tolerance = 2e-7) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], tolerance) << "component " << c;
}

/// The radiance with full shading (s = 1) by one white light.
glm::dvec3 shaded(const Material& m, const glm::dvec3& color, double nl, double nh) {
  return color * (m.ambient + m.diffuse * nl) + m.specular * std::pow(nh, m.shininess);
}

TEST(ReferenceShading, ALightThatTravelsWithTheViewLightsWhatFacesIt) {
  LinearField field;
  field.scene.lights = {directional({-3, 0, 0})};  // comes from +x, where the eye is
  expectNear(field.seenAlong({-1, 0, 0}), shaded(kMaterial, kColor, 1, 1));
  field.scene.lights = {directional({3, 0, 0})};  // comes from behind: ambient only
  expectNear(field.seenAlong({-1, 0, 0}), shaded(kMaterial, kColor, 0, 0));
}

TEST(ReferenceShading, TheNormalIsTurnedToTheViewer) {
  LinearField field;
  field.scene.lights = {directional({3, 0, 0})};
  expectNear(field.seenAlong({1, 0, 0}), shaded(kMaterial, kColor, 1, 1));
  field.a = {-1, 0, 0};
  expectNear(field.seenAlong({1, 0, 0}), shaded(kMaterial, kColor, 1, 1));
}

TEST(ReferenceShading, AnObliqueLightHasTheClosedForm) {
  LinearField field;
  // n = +x towards a viewer at (0.8, 0.6, 0), l = (0.6, 0, 0.8): n.l = 0.6, h along (1.4, 0.6, 0.8).
  field.scene.lights = {directional({-0.6, 0, -0.8})};
  expectNear(field.seenAlong({-0.8, -0.6, 0}), shaded(kMaterial, kColor, 0.6, 1.4 / std::sqrt(2.96)));
}

TEST(ReferenceShading, LightsAddUpWithTheirColoursAndIntensities) {
  LinearField field;
  field.scene.lights = {directional({-0.6, 0, -0.8}, {1, 0.5, 0}, 2), directional({-1, 0, 0}, {0, 0, 1}, 3)};
  const glm::dvec3 first(2, 1, 0), second(0, 0, 3);
  const double nh1 = 1.6 / std::sqrt(3.2), nh2 = 1;  // seen along -x: h along (1.6, 0, 0.8)
  expectNear(field.seenAlong({-1, 0, 0}),
             kColor * (0.1 + 0.6 * (0.6 * first + second)) +
                 0.35 * (std::pow(nh1, 7) * first + std::pow(nh2, 7) * second),
             1e-6);
}

TEST(ReferenceShading, WithoutLightsThereIsAHeadlight) {
  LinearField field;
  field.a = {0.6, 0.8, 0};  // n.v = 0.6, and h = v
  expectNear(field.seenAlong({-1, 0, 0}), shaded(kMaterial, kColor, 0.6, 0.6));
  field.scene.lights.resize(1);
  field.scene.lights[0].color = {0, 1, 0};
  const glm::dvec3 all = shaded(kMaterial, kColor, 0.6, 0.6), none = shaded(kMaterial, kColor, 0, 0);
  expectNear(field.seenAlong({-1, 0, 0}), {none.x, all.y, none.z});
}

TEST(ReferenceShading, APointLightShinesFromItsPositionWithoutFallOff) {
  LinearField field;
  for (const double far : {40.0, 4e7}) {
    // So far away that its direction is the same everywhere in the box.
    field.scene.lights = {{LightType::point, far * 1e6 * glm::dvec3(0.6, 0, 0.8), glm::dvec3(1), 1}};
    expectNear(field.seenAlong({-1, 0, 0}), shaded(kMaterial, kColor, 0.6, 1.6 / std::sqrt(3.2)), 1e-6);
  }
  // A point light next to the ray at x = 0.75: there its light is grazing; matter in front of it faces the
  // eye and is not lit.
  field.scene.channels[0].material = {0, 1, 0, 1};
  field.scene.channels[0].color = {{0, {1, 1, 1}}};
  field.scene.lights = {{LightType::point, {0.75, 2, 0}, glm::dvec3(1), 1}};
  const RayResult found = [&] {
    field.seenAlong({-1, 0, 0});
    return traceReference(field.volume(), field.scene, {20, 0, 0}, {-1, 0, 0});
  }();
  // n.l = (0.75 - x) / sqrt((0.75 - x)^2 + 4) for -3 < x < 0.75.
  double expected = 0;
  for (int i = 0; i < 200000; ++i) {
    const double d = (i + 0.5) * 3.75 / 200000;
    expected += 0.3 * std::exp(-0.3 * (2.25 + d)) * d / std::sqrt(d * d + 4) * 3.75 / 200000;
  }
  EXPECT_NEAR(found.rgba.r, expected, 1e-5);
}

TEST(ReferenceShading, FadesWithTheGradientsMagnitude) {
  LinearField field;
  field.scene.lights = {directional({-1, 0, 0})};
  for (const double range : {0.5, 1.0, 2.0, 10.0, -10.0, 1e6}) {
    field.range = range;
    const double g = std::min(1.0, 1 / std::abs(range)), s = 1 - (1 - g) * (1 - g);
    expectNear(field.seenAlong({-1, 0, 0}), kColor * ((1 - s) + s * (0.1 + 0.6)) + s * 0.35 * glm::dvec3(1));
  }
  field.range = 0;  // a step: any gradient is infinitely steep relative to it; all values lie below it but
                    // have the same opacity
  expectNear(field.seenAlong({-1, 0, 0}), shaded(kMaterial, kColor, 1, 1));
}

TEST(ReferenceShading, OfAConstantFieldIsNone) {
  LinearField field;
  field.a = glm::dvec3(0);
  expectNear(field.seenAlong({-1, 0, 0}), kColor);
  field.range = 0;
  expectNear(field.seenAlong({-1, 0, 0}), kColor);
}

TEST(ReferenceShading, IsTheSameOnIsotropicAnisotropicAndRotatedGrids) {
  LinearField field;
  field.a = {0.3, -0.5, 0.4};
  field.range = 2;
  field.scene.lights = {directional({-0.3, 0.6, -0.8})};
  const double c = std::cos(0.7), s = std::sin(0.7);
  const glm::dmat3 rotation(glm::dvec3(c, s, 0), glm::dvec3(0, 0, 1), glm::dvec3(s, -c, 0));
  const glm::dmat3 stretch(glm::dvec3(2, 0, 0), glm::dvec3(0, 0.5, 0), glm::dvec3(0, 0, 4));
  const glm::dmat3 sheared(glm::dvec3(0.5, 0, 0), glm::dvec3(0.7, 0.9, 0), glm::dvec3(0.2, 0, -1));
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-0.5, 0.7, -0.6));

  const glm::dvec3 n = glm::normalize(field.a), l = glm::normalize(glm::dvec3(0.3, -0.6, 0.8));
  ASSERT_GT(glm::dot(n, -direction), 0.5);
  const double g = glm::length(field.a) * 0.5 / 2, fade = 1 - (1 - g) * (1 - g);  // smallest spacing 0.5
  const glm::dvec3 expected = (1 - fade) * kColor + fade * shaded(kMaterial, kColor, glm::dot(n, l),
                                                                  glm::dot(n, glm::normalize(l - direction)));
  for (const glm::dmat3& columns :
       {glm::dmat3(0.5), stretch, rotation * stretch, sheared, rotation * sheared}) {
    field.columns = columns;
    expectNear(field.seenAlong(direction), expected, 1e-6);
  }
}

/// Two overlapping channels, of extinction 0.2 and 0.3, whose gradients point to the eye and to the side.
struct TwoMaterials {
  Volume volume =
      makeVolume(gridOf({6, 6, 6}), {[](int i, int, int) { return i; }, [](int, int j, int) { return j; }});
  Scene scene = makeScene({solid(0.2, {1, 0, 0}), solid(0.3, {0, 1, 0})});
  glm::dvec3 first = shaded({0.1, 0.6, 0.35, 7}, {1, 0, 0}, 1, 1),  // n along the light and the view
      second = shaded({0.5, 0.9, 0.2, 3}, {0, 1, 0}, 0, 0);         // n across both
  TwoMaterials() {
    scene.shading = true;
    scene.lights = {directional({-1, 0, 0})};
    scene.channels[0].material = {0.1, 0.6, 0.35, 7};
    scene.channels[1].material = {0.5, 0.9, 0.2, 3};
  }
  glm::dvec3 seen(BlendMode mode) {
    scene.blend = mode;
    return glm::dvec3(traceReference(volume, scene, {20, 2, 3}, {-1, 0, 0}).rgba);
  }
};

TEST(ReferenceShading, EveryChannelHasItsOwnMaterialInDensity) {
  TwoMaterials two;
  expectNear(two.seen(BlendMode::density), (1 - std::exp(-3)) * (0.4 * two.first + 0.6 * two.second), 1e-6);
}

TEST(ReferenceShading, MaxUsesTheMaterialOfTheChannelThatIsSeen) {
  TwoMaterials two;
  expectNear(two.seen(BlendMode::max), (1 - std::exp(-1.8)) * two.second, 1e-6);
}

TEST(ReferenceShading, MixUsesEachChannelsMaterialBeforeItWeights) {
  TwoMaterials two;
  two.scene.channels[0].weight = 2;
  expectNear(two.seen(BlendMode::mix), (1 - std::exp(-1.8)) * (2 * 0.2 * two.first + 0.3 * two.second) / 0.3,
             1e-6);
}

TEST(ReferenceShading, CompositeUsesEachChannelsMaterial) {
  TwoMaterials two;
  expectNear(two.seen(BlendMode::composite),
             (1 - std::exp(-1.2)) * two.first + (1 - std::exp(-1.8)) * two.second, 1e-6);
}

TEST(ReferenceShading, DoesNotChangeAlpha) {
  LinearField field;
  field.scene.channels[0] = ramp(-2, 2, 0.8, kColor);
  const glm::dvec3 direction = glm::normalize(glm::dvec3(1, 0.2, 0.1));
  const double lit = traceReference(field.volume(), field.scene, -20.0 * direction, direction).rgba.a;
  field.scene.shading = false;
  EXPECT_NEAR(lit, traceReference(field.volume(), field.scene, -20.0 * direction, direction).rgba.a, 1e-7);
}

TEST(ReferenceShading, RefusesLightsAndMaterialsThatCannotBe) {
  LinearField field;
  const auto refused = [&](const Light& light) {
    field.scene.lights = {light};
    EXPECT_THROW(Integrator(field.volume(), field.scene), Error);
  };
  refused(directional({0, 0, 0}));
  refused(directional({1, 0, std::nan("")}));
  refused(directional({1, 0, 0}, {1, -1, 1}));
  refused(directional({1, 0, 0}, {1, 1, 1}, -2));
  field.scene.lights.clear();
  field.scene.channels[0].material.shininess = 0;
  EXPECT_THROW(Integrator(field.volume(), field.scene), Error);
}

}  // namespace
}  // namespace scolopax::reference
