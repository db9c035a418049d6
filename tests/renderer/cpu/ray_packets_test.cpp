// SPDX-License-Identifier: Apache-2.0
// Rays that are marched many at a time give the same bits as rays marched one by one.
#include "renderer/cpu/ray_packets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <random>

#include "renderer/data/instances.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/raymarch.h"
#include "renderer/kernel/render_pixel.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

/// The random choices for a scene.
struct RandomChoices {
  std::mt19937 random;
  explicit RandomChoices(unsigned seed) : random(seed) {}
  double between(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); }
  int upTo(int most) { return std::uniform_int_distribution<int>(0, most)(random); }
  template <class T>
  T of(std::initializer_list<T> list) {
    return list.begin()[upTo(int(list.size()) - 1)];
  }
};

/// Blobs in mostly empty space, with noise; floats include voxels that are not finite.
template <class T>
ChannelSource blobs(RandomChoices& draw, glm::ivec3 dims) {
  glm::dvec3 centres[3];
  for (glm::dvec3& c : centres)
    c = glm::dvec3(draw.between(0, 1), draw.between(0, 1), draw.between(0, 1)) * glm::dvec3(dims);
  const double radius = draw.between(1, 9), noise = draw.of({0.0, 0.3});
  const bool holes = std::is_floating_point_v<T> && draw.upTo(1) == 1;
  return channelOf<T>(dims, [&](int x, int y, int z) {
    double value = 0;
    for (const glm::dvec3& c : centres)
      value = std::max(value, 1 - glm::length(glm::dvec3(x, y, z) - c) / radius);
    if (value > 0) value *= 1 - noise * draw.between(0, 1);
    if (holes && draw.upTo(40) == 0) return draw.of({std::numeric_limits<double>::quiet_NaN(), HUGE_VAL});
    return value * 200;
  });
}

ChannelSource anyBlobs(RandomChoices& draw, glm::ivec3 dims) {
  switch (draw.upTo(3)) {
    case 0:
      return blobs<std::uint8_t>(draw, dims);
    case 1:
      return blobs<std::uint16_t>(draw, dims);
    case 2:
      return blobs<std::int16_t>(draw, dims);
    default:
      return blobs<float>(draw, dims);
  }
}

ChannelAppearance anyAppearance(RandomChoices& draw) {
  ChannelAppearance a;
  a.rangeLo = draw.of({0.0, 20.0, 150.0});
  a.rangeHi = draw.of({200.0, 120.0, 21.0});
  a.gamma = draw.of({1.0, 1.0, 1.0, 0.5, 2.2});
  a.density = std::pow(10, draw.between(-2, 1.5));
  const double peak = draw.between(0.05, 0.9);
  a.opacity = draw.of<std::vector<OpacityKnot>>(
      {{{0, 0}, {0.15, 0}, {1, 1}},
       {{0, 0}, {peak, 0}, {peak + 1e-4, 1}, {peak + 2e-4, 0}, {1, 0}},
       {{0, 0}, {peak, 0}, {peak, 1}, {1, 0.2}},
       {{0, 1}},
       {{0, 0}, {0.1, 0.3}, {0.2, 0}, {0.3, 0.6}, {0.4, 0}, {0.5, 1}, {0.6, 0}, {1, 0.1}}});
  a.color.clear();
  for (int i = 0, n = draw.of({1, 2, 9}); i < n; ++i)
    a.color.push_back({n > 1 ? double(i) / (n - 1) : 0.0,
                       glm::dvec3(draw.between(0, 1), draw.between(0, 1), draw.between(0, 1))});
  a.material = {draw.of({0.0, 0.3, 1.0}), draw.of({0.0, 0.8}), draw.of({0.0, 0.4}), draw.of({1.0, 30.0})};
  a.visible = draw.upTo(5) > 0;
  return a;
}

Light anyLight(RandomChoices& draw, const Grid& grid) {
  const auto vector = [&] {
    return glm::dvec3(draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1));
  };
  Light light{draw.of({LightType::directional, LightType::point, LightType::headlight}), vector(),
              glm::abs(vector()), draw.of({0.0, 0.5, 2.0})};
  if (light.type == LightType::point) light.vector *= grid.diagonal();
  return light;
}

/// Random clip planes of all or some channels, and crop regions.
void clipAnyhow(RandomChoices& draw, const Volume& volume, Scene& scene) {
  const glm::dvec3 size(volume.grid().dims);
  const auto inside = [&] {
    return glm::dvec3(draw.between(0, 1), draw.between(0, 1), draw.between(0, 1)) * size - 0.5;
  };
  for (int n = draw.upTo(3); n > 0; --n) {
    ClipPlane plane{glm::dvec3(volume.grid().worldFromVoxel * glm::dvec4(inside(), 1)),
                    {draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1)},
                    {}};
    if (draw.upTo(1)) plane.channels = std::vector<int>{draw.upTo(int(scene.channels.size()) - 1)};
    scene.clip.push_back(std::move(plane));
  }
  if (draw.upTo(1)) return;
  const glm::dvec3 a = inside(), b = inside();
  scene.crop = Crop{glm::min(a, b), glm::max(a, b), draw.of({Crop::kInnermost, 0x5a3c96bu, 0x3ffdfffu})};
}

/// Opacity by the gradient for some channels, with ranges typical of the blobs.
void factorAnyhow(RandomChoices& draw, Scene& scene) {
  for (ChannelAppearance& a : scene.channels) {
    if (draw.upTo(1)) continue;
    const double lo = draw.of({0.0, 5.0, 30.0}), hi = draw.of({5.0, 20.0, 80.0});
    a.gradientOpacity =
        GradientOpacity{lo, hi,
                        draw.of<std::vector<OpacityKnot>>({{{0, 0}, {1, 1}},
                                                           {{0, 1}, {0.5, 1}, {0.5, 0.1}, {1, 0}},
                                                           {{0.4, 0}, {0.4, 1}, {0.6, 1}, {0.6, 0}},
                                                           {{0, 0.5}}})};
  }
}

/// A random scene seen from outside or inside, in any light.
Scene anyScene(RandomChoices& draw, const Volume& volume) {
  Scene scene = frontScene(volume, 1 + draw.upTo(40), 1 + draw.upTo(40));
  if (draw.upTo(3) > 0) scene.camera = framingCamera(volume.grid(), 35, 1);
  if (draw.upTo(3) == 0)
    scene.camera.eye = scene.camera.target + glm::dvec3(draw.between(-3, 3), draw.between(-3, 3), 1);
  else if (draw.upTo(1))
    scene.camera.eye += glm::dvec3(draw.between(-9, 9), draw.between(-9, 9), draw.between(-9, 9));
  for (ChannelAppearance& a : scene.channels) a = anyAppearance(draw);
  scene.method = draw.of({Method::raymarch, Method::hybrid});
  scene.blend = draw.of({BlendMode::density, BlendMode::composite, BlendMode::max, BlendMode::mix});
  scene.filter = draw.of({PixelFilter::point, PixelFilter::box});
  scene.step = draw.of({0.0, 0.1, 0.5, 1.0, 4.0, 20.0});
  scene.macrocell = draw.of({1, 4, 4, 7, 64});
  scene.seed = std::uint32_t(draw.upTo(1000));
  scene.shading = draw.upTo(1) == 1;
  scene.shadows = draw.upTo(2) == 0;
  for (int n = draw.upTo(3); n > 0; --n) scene.lights.push_back(anyLight(draw, volume.grid()));
  if (draw.upTo(2) == 0) clipAnyhow(draw, volume, scene);
  if (draw.upTo(2) == 0) factorAnyhow(draw, scene);
  return scene;
}

/// Pixels, their costs, and the first collisions of their rays.
struct Picture {
  std::vector<glm::vec4> pixels;
  std::vector<kernel::SampleCost> cost;
  std::vector<kernel::FirstCollision> first;
};

class RayPackets : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!available(GetParam())) GTEST_SKIP() << "this processor does not have the instruction set";
  }
  /// False if packets leave the scene to single rays.
  bool take(const std::shared_ptr<const Volume>& volume, const Scene& scene) {
    scene_ = scene;
    plan_.emplace(volume, scene);
    view_ = plan_->view();
    tiles_ = packetTileFunction(instance(), view_, GetParam());
    return tiles_ != nullptr;
  }
  Instance instance() const { return instanceOf(scene_.method, scene_.blend, view_); }
  std::size_t count() const { return std::size_t(scene_.width) * std::size_t(scene_.height); }

  /// Renders the pixels that are not done; the others keep the value 3.
  Picture packets(std::uint32_t sample, std::vector<std::uint8_t> done) const {
    const std::atomic<bool> never = false;
    Picture picture{std::vector<glm::vec4>(count(), glm::vec4(3)), std::vector<kernel::SampleCost>(count()),
                    std::vector<kernel::FirstCollision>(count())};
    const Pass pass{.plan = &*plan_,
                    .method = scene_.method,
                    .scene = view_,
                    .number = sampleNumber(scene_.sampling, sample),
                    .pixels = picture.pixels.data(),
                    .cost = picture.cost.data(),
                    .first = picture.first.data(),
                    .done = done.data(),
                    .cancel = &never,
                    .deadline = std::chrono::steady_clock::time_point::max()};
    for (int y = 0; y * kTile < scene_.height; ++y)
      for (int x = 0; x * kTile < scene_.width; ++x) tiles_(pass, x, y);
    EXPECT_EQ(std::count(done.begin(), done.end(), 1), std::ptrdiff_t(count()));
    return picture;
  }
  Picture single(std::uint32_t sample, const std::vector<std::uint8_t>& done) const {
    Picture picture{std::vector<glm::vec4>(count(), glm::vec4(3)), std::vector<kernel::SampleCost>(count()),
                    std::vector<kernel::FirstCollision>(count())};
    const kernel::SampleNumber number = sampleNumber(scene_.sampling, sample);
    const auto renderAll = [&]<class Steps>(std::type_identity<Steps>) {
      visitBlendAndLight(instance(), [&](auto blend, auto lighting) {
        const kernel::RenderPixel<kernel::RayMarch<Steps>, typename decltype(blend)::type,
                                  typename decltype(lighting)::type>
            render{view_, number, picture.pixels.data(), picture.cost.data(), picture.first.data()};
        for (int pixel = 0; pixel < int(count()); ++pixel)
          if (!done[std::size_t(pixel)]) render(pixel);
      });
    };
    if (view_.cutsAtVoxels())
      renderAll(std::type_identity<kernel::VoxelCells>{});
    else
      renderAll(std::type_identity<kernel::EqualSteps>{});
    return picture;
  }
  /// Compares by value, so that 0 equals -0. Counts pixels that are not empty, and opaque ones.
  void expectSameBits(std::uint32_t sample, const std::vector<std::uint8_t>& done) {
    const Picture found = packets(sample, done), expected = single(sample, done);
    for (std::size_t i = 0; i < count(); ++i) {
      const glm::vec4 a = found.pixels[i], b = expected.pixels[i];
      ASSERT_TRUE(a == b) << "sample " << sample << " pixel " << i << " of " << scene_.width << ": " << a.r
                          << ' ' << a.g << ' ' << a.b << ' ' << a.a << " for " << b.r << ' ' << b.g << ' '
                          << b.b << ' ' << b.a;
      ASSERT_EQ(found.cost[i].truncated, expected.cost[i].truncated);
      ASSERT_EQ(found.cost[i].randomBlocks, expected.cost[i].randomBlocks);
      ASSERT_EQ(found.first[i].channel, expected.first[i].channel) << i;
      ASSERT_EQ(found.first[i].depth, expected.first[i].depth) << i;
      met_ += b.a > 0 && expected.first[i].channel >= 0;
      seen_ += b.a > 0 && b.a < 1;
      opaque_ += b.a > 0.999f && b.a <= 1;
    }
  }

  Scene scene_;
  std::optional<RenderPlan> plan_;
  kernel::SceneView view_{};
  TileFunction tiles_ = nullptr;
  int seen_ = 0, opaque_ = 0, met_ = 0;
};

TEST_P(RayPackets, HaveTheBitsOfOneRayAfterTheOther) {
  for (unsigned seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE(seed);
    RandomChoices draw(seed);
    glm::ivec3 dims(2 + draw.upTo(40), 2 + draw.upTo(40), 2 + draw.upTo(40));
    if (draw.upTo(9) == 0) dims[draw.upTo(2)] = 1;
    std::vector<ChannelSource> sources;
    for (int n = draw.of({1, 1, 2, 4, 5, 9}); n > 0; --n) sources.push_back(anyBlobs(draw, dims));
    const auto volume = std::make_shared<const Volume>(
        gridOf(dims, {draw.between(0.5, 2), draw.between(0.5, 2), draw.between(0.5, 2)}), std::move(sources));
    ASSERT_TRUE(take(volume, anyScene(draw, *volume)));
    // Some pixels are done: they must stay unchanged.
    std::vector<std::uint8_t> done(count());
    for (std::size_t i = 0; i < done.size(); i += 7) done[i] = 1;
    for (const std::uint32_t sample : {0u, 70u}) {
      expectSameBits(sample, done);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(seen_, 40000);
  EXPECT_GT(opaque_, 1000);
  EXPECT_GT(met_, 20000);
}

TEST_P(RayPackets, SeeNothingBesideTheVolumeHoweverSteepTheirWay) {
  const glm::ivec3 dims(16);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 200; }));
  Scene scene = frontScene(*volume, 64, 64);
  scene.method = Method::raymarch;
  scene.channels[0] = solid(0.1);
  scene.camera.eye = {0, -100, 7.5};
  scene.camera.target = {1e-40, 0, 7.5};  // the distance to the planes along x overflows a float
  scene.camera.up = {0, 0, 1};
  scene.camera.orthoHeight = 30;
  ASSERT_TRUE(take(volume, scene));
  expectSameBits(0, std::vector<std::uint8_t>(count()));
  EXPECT_GT(seen_, 500);
}

TEST_P(RayPackets, CountEveryRaysSegmentsForItself) {
  // Every second ray is in cells with matter from end to end, which is more segments than a ray may have. The
  // ray next to it has half as many, near or far.
  const glm::ivec3 dims(8, 8, 400);
  const auto volume = volumeOf(gridOf(dims, {1, 1, 40}), channelOf<std::uint8_t>(dims, [](int, int y, int z) {
                                 return ((y + 1) / 2 % 2 == 0) == (z < 200) ? 200 : 0;
                               }));
  Scene scene = frontScene(*volume, 4, 8);
  scene.method = Method::raymarch;
  scene.channels[0] = solid(1e-6);
  scene.channels[0].rangeHi = 255;
  scene.channels[0].opacity = {{0, 0}, {1, 1}};
  scene.step = 0.01;
  scene.macrocell = 1;
  scene.filter = PixelFilter::point;
  ASSERT_TRUE(take(volume, scene));
  const std::vector<std::uint8_t> none(count());
  const Picture found = packets(0, none), expected = single(0, none);
  int whole = 0, cut = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    EXPECT_EQ(found.cost[i].truncated, expected.cost[i].truncated) << i;
    EXPECT_TRUE(found.pixels[i] == expected.pixels[i]) << i;
    if (expected.cost[i].truncated)
      ++cut;
    else
      whole += expected.pixels[i].a > 0;
  }
  EXPECT_EQ(whole, 3 * 4);  // rows 1, 3 and 5 lie between cells of the same kind, the last in that of row 6
  EXPECT_EQ(cut, 5 * 4);
}

TEST_P(RayPackets, CountRaysThatEndInTheirLastSegmentAsWhole) {
  // Almost nothing up to a wall, which is half a step nearer to the eye from ray to ray. The middle ray
  // reaches it after the maximum number of segments. Single rays are computed some segments ahead.
  const glm::ivec3 dims(8, 8, 400);
  const double spacing = 40, step = 0.01;
  const double wall = kernel::kMaxSegments * step / spacing - 0.5;  // in voxels; the box begins at -1/2
  const auto volume =
      volumeOf(gridOf(dims, {1, 1, spacing}), channelOf<float>(dims, [&](int x, int y, int z) {
                 return float(z + (x + 8 * y - 32) * step / 2 / spacing);
               }));
  Scene scene = frontScene(*volume, 8, 8);
  scene.method = Method::raymarch;
  scene.channels[0] = solid(1e6);
  scene.channels[0].rangeHi = 400;
  scene.channels[0].opacity = {{0, 1e-12}, {wall / 400, 1e-12}, {wall / 400, 1}, {1, 1}};
  scene.step = step;
  scene.filter = PixelFilter::point;
  ASSERT_TRUE(take(volume, scene));
  const std::vector<std::uint8_t> none(count());
  const Picture found = packets(0, none), expected = single(0, none);
  int whole = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    EXPECT_EQ(expected.cost[i].truncated, expected.pixels[i].a < 0.5f) << i;
    EXPECT_EQ(found.cost[i].truncated, expected.cost[i].truncated) << i;
    whole += expected.cost[i].truncated == 0;
  }
  EXPECT_THAT(whole, testing::AllOf(testing::Gt(8), testing::Lt(56)));
}

TEST_P(RayPackets, LeaveWhatTheyCannotDoToSingleRays) {
  const glm::ivec3 dims(8);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 9; }));
  Scene scene = frontScene(*volume, 8, 8);
  scene.channels[0] = solid(1);
  const auto takes = [&](auto change) {
    Scene changed = scene;
    changed.method = Method::raymarch;
    change(changed);
    return take(volume, changed);
  };
  for (const BlendMode blend : {BlendMode::density, BlendMode::max, BlendMode::mix, BlendMode::composite})
    EXPECT_TRUE(takes([&](Scene& s) { s.blend = blend; })) << nameOf(blend);
  view_.majorants.cells = glm::ivec3(1024);
  EXPECT_EQ(packetTileFunction(instance(), view_, GetParam()), nullptr);
  EXPECT_FALSE(takes([](Scene& s) { s.method = Method::superposed; }));
}

INSTANTIATE_TEST_SUITE_P(Of, RayPackets, testing::Values(InstructionSet::avx2, InstructionSet::avx512),
                         [](const auto& set) {
                           return std::string(set.param == InstructionSet::avx2 ? "Eight" : "Sixteen");
                         });

}  // namespace
}  // namespace scolopax
