// SPDX-License-Identifier: Apache-2.0
// Shaded rays against tiny steps: in the picture of a data set of eight voxels, on random small volumes with
// all features of a scene, and on real data. The reference's bound on its own error must hold.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "renderer/reference/render.h"
#include "tests/renderer/reference/lit_march.h"
#include "tests/renderer/reference/random_light.h"
#include "tests/support/statistics.h"

namespace scolopax::reference {
namespace {

Volume volumeOfBytes(const glm::ivec3& dims, const std::vector<std::uint8_t>& bytes) {
  std::vector<ChannelSource> channels(1);
  channels[0].voxels = VoxelBuffer(ScalarType::u8, bytes.size());
  std::memcpy(channels[0].voxels.data(), bytes.data(), bytes.size());
  return Volume(gridOf(dims), std::move(channels));
}

void expectAgreement(const RayResult& found, const March& expected, const std::string& what) {
  for (int c = 0; c < 4; ++c)
    EXPECT_NEAR(found.rgba[c], expected.rgba[c], found.error + expected.bound) << what << " component " << c;
}

TEST(ReferenceShading, OfEightBytesIsWhatTinyStepsSay) {
  // The normal flips to the viewer inside a cell. Superposed converges to .2281.
  const Volume volume = volumeOfBytes(glm::ivec3(2), {255, 0, 255, 0, 0, 255, 255, 255});
  Scene scene = makeScene({solid(1, glm::dvec3(1))});
  scene.channels[0].rangeHi = 255;
  scene.channels[0].material = {0, 1, 0, 20};
  scene.shading = true;
  scene.lights = {{LightType::directional, {1, 0, 0}, glm::dvec3(1), 1}};
  scene.camera = {.eye = {5, 4, 3}, .target = glm::dvec3(0.5), .up = {0, 0, 1}, .orthoHeight = 2.0};
  scene.width = scene.height = 8;
  scene.filter = PixelFilter::point;
  const ReferenceImage picture = renderReference(volume, scene, 1);
  EXPECT_NEAR(picture.image.pixels[4 * 8 + 6].r, 0.22801f, 3e-5f);
  EXPECT_LT(picture.maximumRayError, 1e-4);

  const LitMarcher marcher(volume, scene);
  const Integrator integrator(volume, scene);
  const glm::dvec3 forward = glm::normalize(scene.camera.target - scene.camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, scene.camera.up)),
                   up = glm::cross(right, forward);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      const glm::dvec3 origin = scene.camera.eye + 0.25 * ((x - 3.5) * right + (3.5 - y) * up);
      expectAgreement(integrator.trace(origin, forward), marcher.march(origin, forward, 20000),
                      "row " + std::to_string(y) + ", column " + std::to_string(x));
    }
}

/// Compares one ray through each of `usualCount` random scenes, in all blend modes, with tiny steps: the
/// claimed error bounds must hold.
void expectLightClaimsHold(bool shading, bool shadows, int usualCount, int steps, double largestClaim) {
  const int count = test::timesFactor(usualCount);
  for (unsigned seed = 1; seed <= unsigned(count); ++seed) {
    RandomLight draw(seed);
    const Volume volume = draw.volume();
    Scene scene = draw.scene(volume);
    scene.shading = shading;
    scene.shadows = shadows;
    const RandomRay ray(draw, volume, seed);
    const RayResult found = traceReference(volume, scene, ray.origin, ray.direction);
    const March expected = LitMarcher(volume, scene).march(ray.origin, ray.direction, steps, steps);
    expectAgreement(found, expected, "seed " + std::to_string(seed));
    EXPECT_LE(found.error, largestClaim) << "seed " << seed;
  }
}

TEST(Reference, KeepsWhatItClaimsOnRandomScenes) { expectLightClaimsHold(false, false, 100, 20000, 1e-7); }
TEST(ReferenceShading, KeepsWhatItClaimsOnRandomScenes) {
  expectLightClaimsHold(true, false, 150, 20000, 2e-4);
}
TEST(ReferenceShadows, KeepsWhatItClaimsOnRandomScenes) {
  expectLightClaimsHold(false, true, 20, 600, 2e-4);
  expectLightClaimsHold(true, true, 20, 600, 2e-4);
}

TEST(ReferenceShadows, KeepsWhatItClaimsAgainstTheSameWithAThousandthOfTheTolerance) {
  // Shadows narrower than a fifth of a voxel may be missed: of rays like these, 1 in 2500 exceeded the
  // claimed error, by at most 4e-5.
  for (unsigned seed = 1; seed <= unsigned(test::timesFactor(200)); ++seed) {
    RandomLight draw(seed);
    const Volume volume = draw.volume();
    Scene scene = draw.scene(volume);
    scene.shadows = true;
    scene.shading = seed % 2;
    const RandomRay ray(draw, volume, seed);
    const RayResult found = traceReference(volume, scene, ray.origin, ray.direction);
    const RayResult exact = Integrator(volume, scene, 1e-7).trace(ray.origin, ray.direction);
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(found.rgba[c], exact.rgba[c], found.error + exact.error) << "seed " << seed;
  }
}

TEST(ReferenceShading, SeesAHighlightHoweverNarrow) {
  // The light is placed so that the middle of its highlight lies on the ray, somewhere in a cell.
  for (const double shininess : {50.0, 1e3, 1e5, 1e7})
    for (unsigned seed = 1; seed <= 8; ++seed) {
      RandomLight draw(seed);
      const glm::dvec3 ball = glm::dvec3(2) + 0.5 * draw.vector();
      const Volume volume =
          makeVolume(gridOf(glm::ivec3(5)),
                     {[&](int i, int j, int k) { return glm::length(glm::dvec3(i, j, k) - ball); }});
      Scene scene = makeScene({solid(0.5, glm::dvec3(1))});
      scene.channels[0].material = {0, 0, 1, shininess};
      scene.shading = true;
      const glm::dvec3 direction = glm::normalize(draw.vector()), at = glm::dvec3(2) + draw.vector();
      const glm::dvec3 gradient = ScalarField(volume.channels()[0], glm::ivec3(5)).gradient(at);
      glm::dvec3 normal = glm::normalize(gradient);
      if (glm::dot(normal, direction) > 0) normal = -normal;
      const glm::dvec3 l = direction - 2 * glm::dot(direction, normal) * normal;
      scene.lights = {{LightType::directional, -l, glm::dvec3(1), 1}};
      const glm::dvec3 origin = at - 10.0 * direction;
      const RayResult found = traceReference(volume, scene, origin, direction);
      const March expected = LitMarcher(volume, scene).march(origin, direction, 100000);
      expectAgreement(found, expected, "seed " + std::to_string(seed));
      EXPECT_GT(found.rgba.r, 0.02 / std::sqrt(shininess)) << "seed " << seed;
    }
}

TEST(ReferenceShading, SeesTheGlowOfALightBesideTheRay) {
  // A highlight on matter that faces the light; it is as wide as the light's distance from the ray.
  const Volume volume = makeVolume(gridOf(glm::ivec3(6)), {[](int i, int j, int) { return j - 1e-5 * i; }});
  Scene scene = makeScene({solid(0.3, glm::dvec3(1))});
  scene.channels[0].material = {0, 1, 0, 20};
  scene.shading = true;
  for (const double distance : {0.1, 1e-2, 1e-3, 1e-4})
    for (const double x : {2.1, 2.37, 2.5, 2.63}) {
      scene.lights = {{LightType::point, {x, 2.3 + distance, 2.6}, glm::dvec3(1), 1}};
      const glm::dvec3 origin(-9, 2.3, 2.6), direction(1, 0, 0);
      const RayResult found = traceReference(volume, scene, origin, direction);
      expectAgreement(found, LitMarcher(volume, scene).march(origin, direction, 200000),
                      std::to_string(distance) + " from " + std::to_string(x));
      EXPECT_LE(found.error, 1e-4);
    }
}

TEST(ReferenceShading, OfNormalsAcrossTheViewIsOneOfBothSides) {
  // Along x + y = const, where rounding (0.1 is not a double) could flip the normal at every point.
  std::vector<ChannelSource> channels(1);
  channels[0].voxels = VoxelBuffer(ScalarType::u8, 8 * 8 * 8);
  for (std::size_t i = 0; i < 512; ++i)
    channels[0].voxels.as<std::uint8_t>()[i] = std::uint8_t(i % 8 + i / 8 % 8);
  channels[0].slope = 0.1;
  channels[0].intercept = 0.3;
  const Volume volume(gridOf(glm::ivec3(8)), std::move(channels));
  Scene scene = makeScene({solid(0.3, glm::dvec3(1))});
  scene.channels[0].rangeHi = 0.1;
  scene.channels[0].material = {0, 1, 0, 20};
  scene.shading = true;
  scene.lights = {{LightType::directional, {-1, -0.5, 0}, glm::dvec3(1), 1}};
  const RayResult found = traceReference(volume, scene, {-2.7, 9.8, 3.1}, {1, -1, 0});
  const double lit = found.rgba.a * 1.5 / std::sqrt(2) / std::sqrt(1.25);
  EXPECT_NEAR(found.rgba.r * (found.rgba.r - lit), 0, 1e-4);
  EXPECT_LE(found.error, 1e-4);
}

TEST(ReferenceShading, ClaimsMoreWhereLightIsBright) {
  // Matter hidden behind opaque matter may be as bright as the light.
  const Volume volume = makeVolume(gridOf({2, 2, 40}), {[](int, int, int k) { return k; }});
  Scene scene = makeScene({solid(1, glm::dvec3(1))});
  scene.shading = true;
  const auto trace = [&](double intensity) {
    scene.lights = {{LightType::headlight, {}, glm::dvec3(1), intensity}};
    return traceReference(volume, scene, {0.5, 0.5, -9}, {0, 0, 1});
  };
  const RayResult dim = trace(1), bright = trace(1e4);
  EXPECT_LT(dim.error, 1e-4);
  const Material m = scene.channels[0].material;
  for (const auto& [found, light] : {std::pair(dim, 1.0), std::pair(bright, 1e4)}) {
    const double expected = (m.ambient + m.diffuse * light + m.specular * light) * -std::expm1(-40);
    EXPECT_NEAR(found.rgba.r, expected, found.error);
    EXPECT_LT(found.error, 1e-4 * expected);
  }
}

TEST(ReferenceShading, OfNeghipIsWhatTinyStepsSay) {
  const auto path = std::filesystem::path(SCOLOPAX_DATA_DIR) / "scalar/neghip_64x64x64_uint8.derived.raw";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  std::vector<std::uint8_t> bytes(64 * 64 * 64);
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(bytes.data()), 64 * 64 * 64);
  const Volume volume = volumeOfBytes(glm::ivec3(64), bytes);
  Scene scene = makeScene({ramp(0, 255, 0.15)});
  scene.shading = true;
  scene.lights = {{LightType::directional, {1, 0, 0}, glm::dvec3(1), 1}};
  const LitMarcher marcher(volume, scene);
  const Integrator integrator(volume, scene);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const glm::dvec3 forward = glm::normalize(glm::dvec3(-5, -4, -3));
  for (int ray = 0; ray < 60; ++ray) {
    const glm::dvec3 through(64 * unit(random), 64 * unit(random), 64 * unit(random));
    const RayResult found = integrator.trace(through - 200.0 * forward, forward);
    expectAgreement(found, marcher.march(through - 200.0 * forward, forward, 40000),
                    "ray " + std::to_string(ray));
    EXPECT_LE(found.error, 1e-4);
  }
}

}  // namespace
}  // namespace scolopax::reference
