// SPDX-License-Identifier: Apache-2.0
// Opacity by the gradient where the factor is known everywhere: one, which changes no bit of any method's
// picture, or zero, which leaves an empty picture.
#include <gtest/gtest.h>

#include <limits>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

void setAll(Scene& scene, const GradientOpacity& opacity) {
  for (ChannelAppearance& channel : scene.channels) channel.gradientOpacity = opacity;
}

const GradientOpacity kOnes[] = {
    {0, 1, {{0, 1}}},           {5, 60, {{0, 1}, {0.25, 1}, {0.25, 1}, {1, 1}}}, {1e30, 0, {{0, 1}, {1, 1}}},
    {-2, -1, {{0, 0}, {1, 1}}},  // all gradients are above
    {0, 0, {{0, 0}, {1, 1}}},    // a step at 0
};
constexpr std::size_t kConstantOnes = 3;

/// Expects the same bits; for quadrature, which integrates a curve that is not constant, the same up to
/// rounding.
void expectSamePicture(const Image& found, const Image& expected, Method method, bool constant) {
  if (constant || !hasStep(method)) {
    EXPECT_EQ(found.pixels, expected.pixels) << nameOf(method);
    return;
  }
  for (std::size_t i = 0; i < found.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c)
      ASSERT_NEAR(found.pixels[i][c], expected.pixels[i][c], 1e-5f) << nameOf(method) << " pixel " << i;
}
const GradientOpacity kZeros[] = {
    {0, 1, {{0, 0}}},
    {5, 60, {{0, 0}, {0.5, 0}, {1, 0}}},
    {1e5, 1e6, {{0, 0}, {1, 1}}},  // all gradients are below
    {1e6, 1e6, {{0, 0}, {1, 1}}},
    {0, 1, {{0, 1}, {0, 0}, {1, 0}}},  // of two equal knots the later counts
};

TEST(GradientOpacity, OfOneEverywhereChangesNoBit) {
  for (const TestScene which : {TestScene::lumps, TestScene::noise})
    for (int blend = 0; blend < int(std::size(kBlends)); ++blend) {
      const auto made = *testScene(which);
      const Scene plain = withSetting(made.scene, blend, blend);  // every light once
      for (const Method method : kAllMethods) {
        const Image expected = renderAnalog(made.volume, plain, method, 3);
        for (std::size_t i = 0; i < std::size(kOnes); ++i) {
          // Rounding may decide whether a shadow ray intersects anything.
          if (i >= kConstantOnes && method == Method::hybrid && plain.shadows) continue;
          Scene scene = plain;
          setAll(scene, kOnes[i]);
          SCOPED_TRACE(testing::Message()
                       << nameOf(kBlends[blend]) << ' ' << kTestSceneNames[int(which)] << " factor " << i);
          expectSamePicture(renderAnalog(made.volume, scene, method, 3), expected, method, i < kConstantOnes);
        }
      }
    }
}

TEST(GradientOpacity, OfZeroEverywhereLeavesNothing) {
  for (const TestScene which : {TestScene::lumps, TestScene::noise})
    for (const GradientOpacity& zero : kZeros) {
      const auto made = *testScene(which);
      Scene scene = withSetting(made.scene, int(&zero - kZeros) % 4, 3);
      setAll(scene, zero);
      for (const Method method : kAllMethods)
        for (const glm::vec4& pixel : renderAnalog(made.volume, scene, method, 2).pixels)
          ASSERT_EQ(pixel, glm::vec4(0)) << nameOf(method) << " factor " << &zero - kZeros;
    }
}

/// A ramp along z: its gradient is the same everywhere, including the outer half voxels.
template <class T>
std::shared_ptr<const Volume> rampOf(const Grid& grid, double slope = 1, double intercept = 0) {
  return volumeOf(grid, channelOf<T>(
                            grid.dims, [](int, int, int z) { return 10 * z; }, slope, intercept));
}

TEST(GradientOpacity, OfARampIsOnOneSideOfAStep) {
  const glm::ivec3 dims(6, 5, 9);
  const auto expectStep = [](const std::shared_ptr<const Volume>& volume, double steepness) {
    for (const Method method : kAllMethods) {
      Scene scene = frontScene(*volume, 6, 6);
      scene.channels[0] = solid(0.3, kRed);
      const Image whole = renderAnalog(volume, scene, method, 4);
      scene.channels[0].gradientOpacity =
          GradientOpacity{0.99 * steepness, 0.99 * steepness, {{0, 0}, {1, 1}}};
      expectSamePicture(renderAnalog(volume, scene, method, 4), whole, method, false);
      scene.channels[0].gradientOpacity =
          GradientOpacity{1.01 * steepness, 1.01 * steepness, {{0, 0}, {1, 1}}};
      for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 4).pixels)
        ASSERT_EQ(pixel, glm::vec4(0)) << nameOf(method);
    }
  };
  expectStep(rampOf<std::uint8_t>(gridOf(dims)), 10);
  expectStep(rampOf<float>(gridOf(dims, {1, 2, 0.25})), 40);
  expectStep(rampOf<std::int16_t>(gridOf(dims, {1, 2, 4}), -3, 100), 7.5);
  expectStep(rampOf<std::uint16_t>(gridOf({1, 1, 2}, {3, 1, 2}), 0.5, -7), 2.5);
  Grid sheared = gridOf(dims);
  sheared.worldFromVoxel[0] = {1, 0.25, 0, 0};  // the gradient of the voxel coordinate z is still (0, 0, 1)
  expectStep(rampOf<float>(sheared), 10);
}

TEST(GradientOpacity, IsZeroWhereNoDifferenceIsFinite) {
  // The scalar is finite up to the second layer; one voxel further it is not.
  const glm::ivec3 dims(6, 6, 4);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int z) {
                                 return z == 2 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
                               }));
  for (const Method method : kAllMethods) {
    Scene scene = frontScene(*volume, 6, 6);
    scene.channels[0] = solid(100, kRed);
    for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 4).pixels)
      ASSERT_GT(pixel.a, 0.99f) << nameOf(method);
    for (const GradientOpacity& one : kOnes) {
      setAll(scene, one);
      for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 4).pixels)
        ASSERT_EQ(pixel, glm::vec4(0)) << nameOf(method) << " factor " << &one - kOnes;
    }
  }
}

}  // namespace
}  // namespace scolopax
