// SPDX-License-Identifier: Apache-2.0
// The negative controls of the statistical tests: typical defects of renderers, seeded intentionally. The
// comparison with the reference must detect each of them.
//
// It cannot detect two. One scrambling shared by all pixels does not change the expected value of any pixel;
// LowDiscrepancy.LeavesNoiseWithoutStructure detects it. A sample that is lost, or counted twice, is unbiased
// if the sum is divided by the actual count; CpuRenderer.KeepsASampleIndependentOfHowManyCameBefore detects
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "renderer/kernel/trackers/one_process.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/printed_n_dda.h"

namespace scolopax {
namespace {

using namespace test;
using kernel::Analog;
using kernel::Lit;
using kernel::SceneView;
using kernel::Unlit;

/// Shadow rays are those that begin inside the box: the eyes of the test scenes are outside.
bool isShadowRay(kernel::Interval inside) { return !(inside.enter > 0); }

/// Shading uses the right direction of the light; shadow rays go the opposite way.
struct FlippedShadows {
  template <class Blend>
  static std::optional<kernel::Collision> track(const SceneView& scene, kernel::Ray ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    if (isShadowRay(inside)) {
      ray.direction = -ray.direction;
      inside = kernel::clipToScene(scene, ray);
      if (!(inside.enter < inside.exit)) return std::nullopt;
    }
    return kernel::Superposed::track<Blend>(scene, ray, inside, sampler, cost);
  }
};

/// Shadow rays ignore the last channel.
struct ShadowsWithoutTheLastChannel {
  template <class Blend>
  static std::optional<kernel::Collision> track(const SceneView& scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    std::optional<kernel::Collision> nearest;
    const int count = scene.channelCount - (isShadowRay(inside) ? 1 : 0);
    for (int n = 0; n < count; ++n)
      nearest = kernel::trackChannel<Blend>(scene, n, nearest, ray, inside, sampler, cost);
    return nearest;
  }
};

/// Shadow rays ignore the first half voxel: a common but wrong remedy for noise.
struct ShadowsThatBeginLate {
  template <class Blend>
  static std::optional<kernel::Collision> track(const SceneView& scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    if (isShadowRay(inside)) inside.enter += 0.5f * scene.smallestSpacing;
    if (!(inside.enter < inside.exit)) return std::nullopt;
    return kernel::Superposed::track<Blend>(scene, ray, inside, sampler, cost);
  }
};

/// Shadow rays include what clip planes and crop cut away.
struct ShadowsOfWhatIsClipped {
  template <class Blend>
  static std::optional<kernel::Collision> track(SceneView scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    if (isShadowRay(inside)) {
      const kernel::ClipView whole{glm::vec3(-0.5f), glm::vec3(scene.dims) - 0.5f, 0, 0, {}, false, {}, {}};
      scene.clip = whole;
      inside = kernel::clipToScene(scene, ray);
    }
    return kernel::Superposed::track<Blend>(scene, ray, inside, sampler, cost);
  }
};

class Defect : public testing::Test {
 protected:
  void use(TestScene which, BlendMode blend, bool shading, bool shadows) {
    made_ = *testScene(which);
    made_.scene.blend = blend;
    made_.scene.shading = shading;
    made_.scene.shadows = shadows;
    expected_ = reference::renderReference(*made_.volume, made_.scene, 1);
  }
  /// Compares the scene rendered by this kernel, with a defect that `change` puts into the view.
  template <class Tracker, class Blend, class Lighting = Unlit, class Change>
  ::testing::AssertionResult passes(Change&& change) {
    const auto found = replicateKernel<Analog<Tracker>, Blend, Lighting>(made_.volume, made_.scene, change);
    return haveMean(found, made_.scene, expected_);
  }
  template <class Tracker, class Blend, class Lighting>
  ::testing::AssertionResult passes() {
    return passes<Tracker, Blend, Lighting>([](SceneView&) {});
  }
  /// Compares the backend's picture of a changed scene with the reference's of the original.
  ::testing::AssertionResult passesWith(const std::function<void(Scene&)>& change) {
    Scene spoilt = made_.scene;
    change(spoilt);
    return haveMean(replicate(made_.volume, spoilt, Method::superposed), made_.scene, expected_);
  }
  /// Copies the channels that the view points to, so that a test can modify them.
  std::vector<kernel::ChannelView>& ownChannels(SceneView& view) {
    channels_.assign(view.channels, view.channels + view.channelCount);
    view.channels = channels_.data();
    return channels_;
  }
  /// Copies of the bounds, of all channels together and of each, that a test can modify.
  struct Bounds {
    std::vector<kernel::TotalCode> totals;
    std::vector<kernel::BoundTable> tables;
    void scale(float factor) {
      for (kernel::TotalCode& total : totals)
        if (total < kernel::codeOfEmpty(0))
          total = kernel::codeOfTotal(std::bit_cast<float>(std::uint32_t(total) << 16) * factor);
      for (kernel::BoundTable& table : tables)
        for (auto& row : table.largest)
          for (float& bound : row) bound *= factor;
    }
  };
  Bounds& ownMajorants(SceneView& view) {
    const auto& grid = view.majorants;
    const std::size_t cells =
        std::size_t(grid.cells.x) * std::size_t(grid.cells.y) * std::size_t(grid.cells.z);
    majorants_.totals.assign(grid.totals, grid.totals + cells);
    majorants_.tables.assign(grid.tables, grid.tables + view.channelCount);
    view.majorants.totals = majorants_.totals.data();
    view.majorants.tables = majorants_.tables.data();
    return majorants_;
  }

  VolumeAndScene made_;
  reference::ReferenceImage expected_;
  std::vector<kernel::ChannelView> channels_;
  Bounds majorants_;
};

TEST_F(Defect, NoneIsFoundWhereThereIsNone) {
  use(TestScene::figure3, BlendMode::density, true, true);
  EXPECT_TRUE((passes<kernel::Superposed, kernel::BlendDensity, Lit>()));
  EXPECT_TRUE((passes<kernel::NDda, kernel::BlendDensity, Lit>([&](SceneView& view) {
    ownChannels(view);
    ownMajorants(view);
  })));
}

TEST_F(Defect, OfMajorantsATenthTooLowIsFoundInEveryTracker) {
  const auto tooLow = [&](SceneView& view) { ownMajorants(view).scale(0.9f); };
  use(TestScene::figure3, BlendMode::density, false, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendDensity>(tooLow)));
  EXPECT_FALSE((passes<kernel::Cumulative, kernel::BlendDensity>(tooLow)));
  EXPECT_FALSE((passes<kernel::SyncDda, kernel::BlendDensity>(tooLow)));
  EXPECT_FALSE((passes<kernel::NDda, kernel::BlendDensity>(tooLow)));
  use(TestScene::figure3, BlendMode::max, false, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendMax>(tooLow)));
  EXPECT_FALSE((passes<kernel::NDda, kernel::BlendMax>(tooLow)));
}

TEST_F(Defect, OfTheBoundOfMaxInBlendModeDensityIsFound) {
  use(TestScene::figure3, BlendMode::density, false, false);
  EXPECT_FALSE((passes<kernel::Cumulative, kernel::BlendDensity>([&](SceneView& view) {
    auto& totals = ownMajorants(view).totals;
    for (std::size_t i = 0; i < totals.size(); ++i)
      totals[i] = kernel::codeOfTotal(
          std::max({view.majorants.bound(i, 0), view.majorants.bound(i, 1), view.majorants.bound(i, 2)}));
  })));
}

TEST_F(Defect, OfTheOrderThatListing3PrintsIsFound) {
  // Channels that alternate between thin and dense along the ray, with different phases.
  const glm::ivec3 dims(16, 16, 32);
  const auto layers = [](int phase) {
    return [phase](int, int, int z) { return (z / 4 + phase) % 2 ? 255 : 4; };
  };
  made_.volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, layers(0)),
                          channelOf<std::uint8_t>(dims, layers(1)), channelOf<std::uint8_t>(dims, layers(0)));
  made_.scene = frontScene(*made_.volume, 16, 16);
  made_.scene.filter = PixelFilter::point;
  for (int i = 0; i < 3; ++i) {
    ChannelAppearance& a = made_.scene.channels[std::size_t(i)];
    a.rangeHi = 255;
    a.density = 0.1;
    a.color = {{0, glm::dvec3(i == 0, i == 1, i == 2)}};
  }
  expected_ = reference::renderReference(*made_.volume, made_.scene, 1);
  EXPECT_TRUE((passes<kernel::NDda, kernel::BlendDensity, Unlit>()));
  EXPECT_FALSE((passes<PrintedNDda, kernel::BlendDensity, Unlit>()));
}

TEST_F(Defect, OfALightThatShinesTheOtherWayIsFound) {
  for (const BlendMode blend : kBlends)
    for (const bool shading : {false, true}) {
      use(TestScene::lumps, blend, shading, true);
      EXPECT_FALSE(passesWith([](Scene& scene) { scene.lights[0].vector = -scene.lights[0].vector; }));
    }
}

TEST_F(Defect, OfShadowRaysThatLookTheOtherWayIsFound) {
  use(TestScene::lumps, BlendMode::density, false, true);
  EXPECT_FALSE((passes<FlippedShadows, kernel::BlendDensity, Lit>()));
  use(TestScene::lumps, BlendMode::max, true, true);
  EXPECT_FALSE((passes<FlippedShadows, kernel::BlendMax, Lit>()));
}

TEST_F(Defect, OfShadowRaysThatMissOneChannelIsFound) {
  use(TestScene::lumps, BlendMode::density, false, true);
  EXPECT_FALSE((passes<ShadowsWithoutTheLastChannel, kernel::BlendDensity, Lit>()));
  use(TestScene::lumps, BlendMode::density, true, true);
  EXPECT_FALSE((passes<ShadowsWithoutTheLastChannel, kernel::BlendDensity, Lit>()));
}

TEST_F(Defect, OfShadowRaysThatBeginLateIsFound) {
  use(TestScene::lumps, BlendMode::density, false, true);
  EXPECT_FALSE((passes<ShadowsThatBeginLate, kernel::BlendDensity, Lit>()));
}

TEST_F(Defect, OfTheFirstChannelsMaterialForAllIsFound) {
  const auto firstMaterial = [&](SceneView& view) {
    for (auto& channel : ownChannels(view)) channel.material = view.channels[0].material;
  };
  use(TestScene::lumps, BlendMode::density, true, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendDensity, Lit>(firstMaterial)));
  use(TestScene::lumps, BlendMode::max, true, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendMax, Lit>(firstMaterial)));
  use(TestScene::lumps, BlendMode::mix, true, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendMix, Lit>(firstMaterial)));
  use(TestScene::lumps, BlendMode::composite, true, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendComposite, Lit>(firstMaterial)));
}

TEST_F(Defect, OfGradientsInUnitsOfVoxelsIsFound) {
  use(TestScene::lumps, BlendMode::density, true, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendDensity, Lit>(
      [](SceneView& view) { view.gradientFromVoxel = glm::mat3(1.0f); })));
}

TEST_F(Defect, OfLightInSceneThatHasNoneIsFound) {
  use(TestScene::lumps, BlendMode::density, false, false);
  EXPECT_FALSE(passesWith([](Scene& scene) { scene.shading = true; }));
  EXPECT_FALSE(passesWith([](Scene& scene) { scene.shadows = true; }));
}

TEST_F(Defect, OfDensityPerVoxelIsFound) {
  use(TestScene::lumps, BlendMode::density, false, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendDensity>([&](SceneView& view) {
    for (auto& channel : ownChannels(view)) channel.density *= view.smallestSpacing;
  })));
}

TEST_F(Defect, OfHalfAVoxelIsFound) {
  use(TestScene::lumps, BlendMode::density, false, false);
  EXPECT_FALSE(
      (passes<kernel::Superposed, kernel::BlendDensity>([](SceneView& view) { view.rays.origin0 += 0.5f; })));
}

/// A clip plane for all channels, a clip plane for the first channel, and regions that do not form a box.
void clipOften(Scene& scene, const Grid& grid) {
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  scene.clip = {{centre, {0.2, -1, 0.4}, {}}, {centre, {1, 0.3, -0.2}, std::vector<int>{0}}};
  scene.crop = Crop{0.3 * glm::dvec3(grid.dims), 0.6 * glm::dvec3(grid.dims), 0x7f3c9e7u};
}

TEST_F(Defect, OfClippingIsFound) {
  made_ = *testScene(TestScene::lumps);
  clipOften(made_.scene, made_.volume->grid());
  expected_ = reference::renderReference(*made_.volume, made_.scene, 1);
  const auto passesChanged = [&](auto&& change) {
    return passes<kernel::Superposed, kernel::BlendDensity>(change);
  };
  EXPECT_TRUE(passesChanged([](SceneView&) {}));
  EXPECT_FALSE(passesChanged([](SceneView& view) { view.clip.planes[0].offset += 0.5f; }));
  EXPECT_FALSE(passesChanged([](SceneView& view) { view.clip.planes[1].channels = 2; }));
  EXPECT_FALSE(passesChanged([](SceneView& view) { view.clip.planes[1].normal *= -1.0f; }));
  EXPECT_FALSE(passesChanged([](SceneView& view) { view.clip.parts = false; }));
  EXPECT_FALSE(passesChanged([](SceneView& view) {  // axes in the wrong order
    const auto regions = std::to_array(view.clip.regions);
    for (std::size_t i = 0; i < 27; ++i) view.clip.regions[i] = regions[i / 9 + i / 3 % 3 * 3 + i % 3 * 9];
  }));
  EXPECT_FALSE(passesWith([](Scene& scene) { scene.crop->high.x -= 0.5; }));
}

TEST_F(Defect, OfShadowsOfWhatIsClippedIsFound) {
  made_ = *testScene(TestScene::lumps);
  made_.scene.shadows = true;
  clipOften(made_.scene, made_.volume->grid());
  expected_ = reference::renderReference(*made_.volume, made_.scene, 1);
  EXPECT_TRUE((passes<kernel::Superposed, kernel::BlendDensity, Lit>()));
  EXPECT_FALSE((passes<ShadowsOfWhatIsClipped, kernel::BlendDensity, Lit>()));
}

TEST_F(Defect, OfWeightsThatAreForgottenIsFound) {
  use(TestScene::lumps, BlendMode::mix, false, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendMix>([&](SceneView& view) {
    for (auto& channel : ownChannels(view)) channel.weight = 1;
  })));
}

TEST_F(Defect, OfAnotherBlendModeIsFound) {
  for (const BlendMode blend : kBlends) {
    use(TestScene::lumps, blend, false, false);
    for (const BlendMode other : kBlends)
      EXPECT_EQ(bool(passesWith([&](Scene& scene) { scene.blend = other; })), blend == other)
          << nameOf(other) << " for " << nameOf(blend);
  }
}

TEST_F(Defect, OfOneScramblingForAllReplicatesIsFound) {
  use(TestScene::lumps, BlendMode::density, false, false);
  EXPECT_FALSE((passes<kernel::Superposed, kernel::BlendDensity>([](SceneView& view) { view.seed = 5; })));
}

TEST_F(Defect, OfASampleLostOrCountedTwiceIsFound) {
  use(TestScene::lumps, BlendMode::density, false, false);
  for (const double counted : {-1.0, 1.0}) {
    auto found = replicate(made_.volume, made_.scene, Method::superposed);
    const float scale = float(1 + counted / found.samples);
    for (Image& picture : found.pictures)
      for (glm::vec4& pixel : picture.pixels) pixel *= scale;
    EXPECT_FALSE(haveMean(found, made_.scene, expected_)) << counted;
  }
}

TEST_F(Defect, OfOneMethodIsADifferenceBetweenTwo) {
  use(TestScene::figure3, BlendMode::density, false, false);
  const auto tooLow = [&](SceneView& view) { ownMajorants(view).scale(0.9f); };
  const auto good = replicate(made_.volume, made_.scene, Method::syncDda);
  EXPECT_TRUE(haveSameMean(good, replicate(made_.volume, made_.scene, Method::nDda), made_.scene));
  EXPECT_FALSE(haveSameMean(good,
                            (replicateKernel<Analog<kernel::Cumulative>, kernel::BlendDensity, Unlit>(
                                made_.volume, made_.scene, tooLow)),
                            made_.scene));
}

}  // namespace
}  // namespace scolopax
