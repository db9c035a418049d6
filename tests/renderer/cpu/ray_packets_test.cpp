// SPDX-License-Identifier: Apache-2.0
// Rays that are marched eight at a time give the bits of marching one after the other.
#include "renderer/cpu/ray_packets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "renderer/cpu/sample_batch.h"
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

/// What is drawn at random about a scene comes from here.
struct Draw {
  std::mt19937 random;
  explicit Draw(unsigned seed) : random(seed) {}
  double between(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); }
  int upTo(int most) { return std::uniform_int_distribution<int>(0, most)(random); }
  template <class T>
  T of(std::initializer_list<T> list) {
    return list.begin()[upTo(int(list.size()) - 1)];
  }
};

/// Blobs in much nothing, with noise; floats have voxels that are not finite.
template <class T>
ChannelSource blobs(Draw& draw, glm::ivec3 dims) {
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

ChannelSource anyBlobs(Draw& draw, glm::ivec3 dims) {
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

ChannelAppearance anyAppearance(Draw& draw) {
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

Light anyLight(Draw& draw, const Grid& grid) {
  const auto vector = [&] {
    return glm::dvec3(draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1));
  };
  Light light{draw.of({LightType::directional, LightType::point, LightType::headlight}), vector(),
              glm::abs(vector()), draw.of({0.0, 0.5, 2.0})};
  if (light.type == LightType::point) light.vector *= grid.diagonal();
  return light;
}

TEST(RayPackets, HaveTheBitsOfOneRayAfterTheOther) {
  if (!available(InstructionSet::avx2)) GTEST_SKIP() << "this processor has no AVX2";
  const std::atomic<bool> never = false;
  int pictures = 0, seen = 0, opaque = 0;
  std::uint64_t fetches = 0, fetchesOneByOne = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Draw draw(seed);
    glm::ivec3 dims(2 + draw.upTo(40), 2 + draw.upTo(40), 2 + draw.upTo(40));
    if (draw.upTo(9) == 0) dims[draw.upTo(2)] = 1;
    std::vector<ChannelSource> sources;
    for (int n = draw.of({1, 1, 2, 4, 5, 9}); n > 0; --n) sources.push_back(anyBlobs(draw, dims));
    const auto volume = std::make_shared<const Volume>(
        gridOf(dims, {draw.between(0.5, 2), draw.between(0.5, 2), draw.between(0.5, 2)}), std::move(sources));
    Scene scene = frontScene(*volume, 1 + draw.upTo(40), 1 + draw.upTo(40));
    if (draw.upTo(3) > 0) scene.camera = framingCamera(volume->grid(), 35, 1);
    if (draw.upTo(3) == 0)  // within
      scene.camera.eye = scene.camera.target + glm::dvec3(draw.between(-3, 3), draw.between(-3, 3), 1);
    else if (draw.upTo(1))
      scene.camera.eye += glm::dvec3(draw.between(-9, 9), draw.between(-9, 9), draw.between(-9, 9));
    for (ChannelAppearance& a : scene.channels) a = anyAppearance(draw);
    scene.method = draw.of({Method::raymarch, Method::hybrid});
    scene.blend = draw.of({BlendMode::density, BlendMode::density, BlendMode::composite});
    scene.filter = draw.of({PixelFilter::point, PixelFilter::box});
    scene.step = draw.of({0.1, 0.5, 1.0, 4.0, 20.0});
    scene.macrocell = draw.of({1, 4, 4, 7, 64});
    scene.seed = seed;
    scene.shading = draw.upTo(1) == 1;
    scene.shadows = draw.upTo(2) == 0;
    for (int n = draw.upTo(3); n > 0; --n) scene.lights.push_back(anyLight(draw, volume->grid()));
    RenderPlan plan(volume);
    plan.update(scene);
    kernel::SceneView view = plan.view();
    view.sampleBatch = sampleBatchFor(InstructionSet::avx2);
    const TileFunction tiles = packetTileFunction(scene, view);
    const bool finite =
        std::all_of(view.channels, view.channels + view.channelCount, [](const auto& c) { return c.finite; });
    ASSERT_EQ(tiles != nullptr, finite || scene.channels.size() > 4);
    if (!tiles) continue;
    const auto count = std::size_t(scene.width) * std::size_t(scene.height);
    for (const std::uint32_t sample : {0u, 70u}) {
      const auto number = sampleNumber(scene.sampling, sample);
      std::vector<glm::vec4> found(count, glm::vec4(-1)), expected(count, glm::vec4(-2));
      std::vector<kernel::SampleCost> cost(count), costExpected(count);
      std::vector<std::uint8_t> done(count);
      // Some are done: they stay as they are.
      for (std::size_t i = 0; i < count; i += 7) done[i] = 1, found[i] = expected[i] = glm::vec4(3);
      const auto doneBefore = done;
      const Pass pass{view,    number,      found.data(), cost.data(),
                      nullptr, done.data(), &never,       std::chrono::steady_clock::time_point::max()};
      for (int y = 0; y * kTile < scene.height; ++y)
        for (int x = 0; x * kTile < scene.width; ++x) tiles(pass, x, y);
      for (int pixel = 0; pixel < int(count); ++pixel) {
        if (doneBefore[std::size_t(pixel)]) continue;
        visitBlendAndLight(scene, [&](auto blend, auto features) {
          kernel::RenderPixel<kernel::RayMarch, typename decltype(blend)::type,
                              typename decltype(features)::type>{view, number, expected.data(),
                                                                 costExpected.data()}(pixel);
        });
      }
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_TRUE(done[i]);
        // By value: a zero is as good as another.
        ASSERT_TRUE(found[i] == expected[i])
            << "scene " << seed << " sample " << sample << " pixel " << i << " of " << scene.width << ": "
            << found[i].r << ' ' << found[i].g << ' ' << found[i].b << ' ' << found[i].a << " for "
            << expected[i].r << ' ' << expected[i].g << ' ' << expected[i].b << ' ' << expected[i].a;
        fetches += cost[i].fetches, fetchesOneByOne += costExpected[i].fetches;
        EXPECT_EQ(cost[i].truncated, costExpected[i].truncated);
        seen += expected[i].a > 0 && expected[i].a < 1;
        opaque += expected[i].a > 0.999f;
      }
      ++pictures;
    }
  }
  EXPECT_GT(pictures, 600);
  EXPECT_GT(seen, 40000);
  EXPECT_GT(opaque, 1000);
  RecordProperty("fetches", std::to_string(fetches));
  RecordProperty("fetchesOneByOne", std::to_string(fetchesOneByOne));
}

TEST(RayPackets, LeaveWhatTheyCannotDoToSingleRays) {
  const glm::ivec3 dims(8);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 9; }));
  Scene scene = frontScene(*volume, 8, 8);
  scene.channels[0] = solid(1);
  RenderPlan plan(volume);
  const auto packets = [&](auto change) {
    Scene changed = scene;
    changed.method = Method::raymarch;
    change(changed);
    plan.update(changed);
    return packetTileFunction(changed, plan.view()) != nullptr;
  };
  EXPECT_EQ(packets([](Scene&) {}), available(InstructionSet::avx2));
  EXPECT_FALSE(packets([](Scene& s) { s.method = Method::superposed; }));
  EXPECT_FALSE(packets([](Scene& s) { s.blend = BlendMode::max; }));
  EXPECT_FALSE(packets([](Scene& s) { s.blend = BlendMode::mix; }));
}

}  // namespace
}  // namespace scolopax
