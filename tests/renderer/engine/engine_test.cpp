// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <thread>

#include "renderer/core/error.h"
#include "renderer/metrics/metrics.h"
#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "tests/support/orbitals.h"
#include "tests/support/statistics.h"

namespace scolopax {
namespace {

using namespace test;

Image render(const std::shared_ptr<const Volume>& volume, const Scene& scene, int samples, int threads) {
  const auto renderer = makeCpuRenderer(volume, threads);
  renderer->setScene(scene);
  for (int i = 0; i < samples; ++i) renderer->renderSample(kNever);
  return renderer->image();
}

TEST(CpuRenderer, GivesTheSameBitsForAnyNumberOfThreads) {
  const auto volume = orbitals();
  for (const Method method : kTrackers) {
    Scene scene = orbitalScene(*volume);
    scene.method = method;
    const Image one = render(volume, scene, 5, 1);
    EXPECT_TRUE(sameBits(one, render(volume, scene, 5, 2)));
    EXPECT_TRUE(sameBits(one, render(volume, scene, 5, 0)));
    scene.seed = 1;
    EXPECT_FALSE(sameBits(one, render(volume, scene, 5, 2)));
  }
}

TEST(CpuRenderer, KeepsASampleIndependentOfHowManyCameBefore) {
  // A sample is the same, even if another renderer rendered the ones before it: no sample is lost or
  // repeated.
  const auto volume = orbitals();
  const Scene scene = orbitalScene(*volume);
  const Image three = render(volume, scene, 3, 2), four = render(volume, scene, 4, 2);
  double difference = 0;
  for (std::size_t i = 0; i < three.pixels.size(); ++i) {
    const glm::vec4 fourth = four.pixels[i] * 4.0f - three.pixels[i] * 3.0f;
    for (int c = 0; c < 4; ++c) {  // every sample of this scene is 0 or 1
      const float nearest = fourth[c] < 0.5f ? 0.0f : 1.0f;
      ASSERT_NEAR(fourth[c], nearest, 1e-5);
    }
    difference += fourth.a;
  }
  EXPECT_GT(difference, 0);
}

TEST(CpuRenderer, LeavesTheFilmAsItWasWhenAPassIsCancelled) {
  const auto volume = orbitals();
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(orbitalScene(*volume));
  renderer->renderSample(kNever);
  const Image before = renderer->image();
  const std::atomic<bool> always = true;
  EXPECT_FALSE(renderer->renderSample(always));
  EXPECT_EQ(renderer->samples(), 1u);
  EXPECT_TRUE(sameBits(before, renderer->image()));
  EXPECT_TRUE(renderer->renderSample(kNever));
  EXPECT_TRUE(sameBits(renderer->image(), render(volume, orbitalScene(*volume), 2, 2)));
}

TEST(CpuRenderer, GoesOnWithAPassThatUsedUpItsBudget) {
  const auto volume = orbitals();
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(orbitalScene(*volume));
  EXPECT_FALSE(renderer->renderSample(kNever, std::chrono::nanoseconds(0)));
  EXPECT_EQ(renderer->samples(), 0u);
  int calls = 1;
  while (!renderer->renderSample(kNever, std::chrono::microseconds(200)) && calls < 100000) ++calls;
  EXPECT_TRUE(sameBits(renderer->image(), render(volume, orbitalScene(*volume), 1, 2)));
}

TEST(CpuRenderer, StopsWithinARayOfACancelHoweverDenseTheScene) {
  // A dense channel over empty space: a ray has up to a million tentative collisions. The test would time out
  // if cancelling waited for the end of a tile, let alone of the pass.
  const glm::ivec3 dims(32, 32, 32);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) {
                                 return (x + y + z) % 7 == 0 ? 255 : 0;
                               }));
  Scene scene = frontScene(*volume, 512, 512);
  scene.channels[0].rangeLo = 254;
  scene.channels[0].rangeHi = 255;
  scene.channels[0].density = 1e6;
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(scene);
  std::atomic<bool> cancel = false;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    cancel = true;
  });
  renderer->renderSample(cancel);
  canceller.join();
  EXPECT_EQ(renderer->samples(), 0u);
}

TEST(CpuRenderer, StopsInTheMiddleOfALongRay) {
  // One pixel, whose ray is marched and lit in millions of steps: if it were completed, there would be a
  // sample.
  const glm::ivec3 dims(8, 8, 8192);
  const auto volume = volumeOf(
      gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return 1 + (x + y + z) % 7; }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0].rangeHi = 255;
  scene.channels[0].density = 0.001;
  scene.method = Method::raymarch;
  scene.step = 0.01;
  scene.shadows = true;
  for (int i = 0; i < 8; ++i)
    scene.lights.push_back({LightType::directional, {0.01 * i, 0, 1}, glm::dvec3(1), 1});
  const auto renderer = makeCpuRenderer(volume, 1);
  renderer->setScene(scene);
  std::atomic<bool> cancel = false;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    cancel = true;
  });
  renderer->renderSample(cancel);
  canceller.join();
  EXPECT_EQ(renderer->samples(), 0u);
}

TEST(CpuRenderer, RebuildsOnlyTheEditedChannelAndNothingForAColour) {
  const auto volume = orbitals();
  const auto renderer = makeCpuRenderer(volume, 2);
  Scene scene = orbitalScene(*volume);
  RebuildStats stats = renderer->setScene(scene);
  EXPECT_EQ(stats.majorantChannels, 3);
  EXPECT_EQ(stats.majorantCells, 6u * 6 * 6);
  EXPECT_TRUE(stats.filmReset);

  scene.channels[1].opacity = {{0, 0}, {0.5, 1}};
  stats = renderer->setScene(scene);
  EXPECT_EQ(stats.majorantChannels, 1);
  EXPECT_GT(stats.majorantCells, 0u);
  EXPECT_EQ(stats.macrocellChannels, 0);
  EXPECT_TRUE(stats.filmReset);

  scene.channels[2].color = {{0, {1, 1, 0}}};
  scene.camera.eye.x += 1;
  stats = renderer->setScene(scene);
  EXPECT_EQ(stats.majorantChannels, 0);
  EXPECT_EQ(stats.majorantCells, 0u);
  EXPECT_TRUE(stats.filmReset);

  scene.background = {1, 1, 1};  // added to the finished image
  stats = renderer->setScene(scene);
  EXPECT_FALSE(stats.filmReset);

  scene.channels[0].visible = false;
  EXPECT_EQ(renderer->setScene(scene).majorantChannels, 0);
  scene.channels[0].visible = true;
  EXPECT_EQ(renderer->setScene(scene).majorantChannels, 0);

  scene.macrocell = 8;
  stats = renderer->setScene(scene);
  EXPECT_EQ(stats.macrocellChannels, 3);
  EXPECT_EQ(stats.majorantChannels, 3);
}

TEST(CpuRenderer, DrawsAfterAnySequenceOfEditsWhatAFreshRendererDraws) {
  const auto volume = orbitals();
  const auto edited = makeCpuRenderer(volume, 2);
  Scene scene = orbitalScene(*volume);
  const std::vector<std::function<void(Scene&)>> edits = {
      [](Scene& s) { s.channels[0].visible = false; },
      [](Scene& s) {
        s.channels[0].opacity = {{0, 0}, {0.1, 1}};
      },  // while hidden
      [](Scene& s) { s.channels[0].visible = true; },
      [](Scene& s) { s.channels[1].density = 0; },
      [](Scene& s) { s.macrocell = 3; },
      [](Scene& s) { s.channels[1].density = 2; },
      [](Scene& s) {
        s.channels[2].color = {{0, {1, 0, 1}}};
      },
      [](Scene& s) { s.width = 20, s.height = 61; },
      [](Scene& s) { s.channels[2].rangeHi *= 0.3; },
      [](Scene& s) {
        s.channels[0].gradientOpacity = GradientOpacity{0, 0.3 * s.channels[0].rangeHi, {{0, 0}, {1, 1}}};
      },
      [](Scene& s) {
        s.channels[0].gradientOpacity->factor = {{0, 1}, {0.5, 0}};
      },
      [](Scene& s) { s.macrocell = 5; },
      [](Scene& s) { s.channels[1].gradientOpacity = s.channels[0].gradientOpacity; },
      [](Scene& s) { s.channels[0].visible = false; },
      [](Scene& s) { s.channels[0].gradientOpacity->rangeHi *= 2; },  // while hidden
      [](Scene& s) { s.channels[0].visible = true; },
      [](Scene& s) { s.channels[1].gradientOpacity.reset(); },
  };
  edited->setScene(scene);
  edited->renderSample(kNever);
  for (std::size_t i = 0; i < edits.size(); ++i) {
    edits[i](scene);
    edited->setScene(scene);
    EXPECT_EQ(edited->samples(), 0u);  // two scenes must not be mixed in one image
    edited->renderSample(kNever);
    EXPECT_TRUE(sameBits(edited->image(), render(volume, scene, 1, 2))) << "edit " << i;
  }
}

TEST(CpuRenderer, KeepsPlanAndFilmWhenASceneIsRefused) {
  const auto volume = orbitals();
  const auto renderer = makeCpuRenderer(volume, 2);
  const Scene good = orbitalScene(*volume);
  renderer->setScene(good);
  renderer->renderSample(kNever);
  const std::vector<std::function<void(Scene&)>> mistakes = {
      [](Scene& s) { s.channels.pop_back(); },
      [](Scene& s) { s.width = 0; },
      [](Scene& s) { s.height = 1 << 30; },
      [](Scene& s) { s.macrocell = 0; },
      [](Scene& s) { s.camera.eye = s.camera.target; },
      [](Scene& s) {
        s.channels[0].opacity = {{0.5, 1}, {0.2, 1}};
      },
      [](Scene& s) { s.channels[0].opacity.clear(); },
      [](Scene& s) { s.channels[1].gamma = 0; },
      [](Scene& s) { s.channels[1].rangeHi = std::numeric_limits<double>::quiet_NaN(); },
      [](Scene& s) {
        s.channels[1].gradientOpacity = GradientOpacity{0, 1, {}};
      },
      [](Scene& s) {
        s.channels[1].gradientOpacity = GradientOpacity{0, 1, {{0.5, 1}, {0.2, 1}}};
      },
      [](Scene& s) {
        s.channels[1].gradientOpacity = GradientOpacity{0, std::numeric_limits<double>::infinity(), {{0, 1}}};
      },
  };
  for (std::size_t i = 0; i < mistakes.size(); ++i) {
    Scene bad = good;
    mistakes[i](bad);
    EXPECT_THROW(renderer->setScene(bad), Error) << "mistake " << i;
    EXPECT_EQ(renderer->samples(), 1u);
  }
  renderer->renderSample(kNever);
  EXPECT_TRUE(sameBits(renderer->image(), render(volume, good, 2, 2)));
}

TEST(CpuRenderer, KeepsPlanAndFilmWhenASceneIsNotWantedAnyMore) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  const auto renderer = makeCpuRenderer(volume, 0);
  renderer->setScene(scene);
  for (int i = 0; i < 3; ++i) renderer->renderSample(kNever);
  const Image before = renderer->image();
  std::stop_source stop;
  stop.request_stop();
  Scene other = scene;
  other.macrocell = 2;
  other.width += 1;
  try {
    renderer->setScene(other, stop.get_token());
    FAIL() << "took what nobody wants";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  EXPECT_TRUE(sameBits(before, renderer->image()));
  EXPECT_FALSE(renderer->setScene(scene).filmReset);
}

TEST(CpuRenderer, TakesItsMemoryFromTheBudgetAndRefusesWhatIsNotThere) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.width = scene.height = 64;
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(16) << 20);
  {
    const auto renderer = makeCpuRenderer(volume, 0, memory);
    renderer->setScene(scene);
    EXPECT_EQ(memory->used(MemoryUse::films), 64u * 64u * (16 + 32 + 32 + 1));
    EXPECT_GT(memory->used(MemoryUse::grids), 0u);
    renderer->renderSample(kNever);
    const Image before = renderer->image();
    Scene large = scene;
    large.width = large.height = 2048;
    EXPECT_THROW(renderer->setScene(large), Error);
    EXPECT_TRUE(sameBits(before, renderer->image()));
    const auto plain = memory->used(MemoryUse::films);
    renderer->recordAovs();
    EXPECT_EQ(memory->used(MemoryUse::films),
              plain + 64u * 64u * (16 + 8 + 8 + 8 + 4 * volume->channels().size()));
    const auto grids = memory->used(MemoryUse::grids);
    const auto second = makeCpuRenderer(volume, 0, memory);
    second->setScene(scene);
    EXPECT_LT(memory->used(MemoryUse::grids), 2 * grids);  // the macrocells are shared
  }
  EXPECT_EQ(memory->used(MemoryUse::films), 0u);
  EXPECT_EQ(memory->used(MemoryUse::grids), 0u);
}

TEST(CpuRenderer, TakesNoMoreMemoryAfterManyEditsAndNoneForAnEditThatIsRefused) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.width = scene.height = 16;
  scene.macrocell = 1;
  const Histogram& values = volume->channels()[0].histogram;
  const auto edit = [&](int i) {
    scene.channels[0].opacity = {{0, 0}, {0.1 + 0.04 * (i % 20), 1}, {1, 0.2}};
    GradientOpacity& factor = scene.channels[0].gradientOpacity.emplace();
    factor.rangeHi = (values.maximum - values.minimum) * (1 + i % 3);
  };
  std::uint64_t most = 0;
  {
    const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(1) << 30);
    const auto renderer = makeCpuRenderer(volume, 0, memory);
    edit(0);
    renderer->setScene(scene);
    const std::uint64_t first = memory->used(MemoryUse::grids);
    for (int i = 1; i <= 20; ++i) {
      edit(i);
      renderer->setScene(scene);
      EXPECT_EQ(memory->used(MemoryUse::grids), first) << i;
    }
    most = first + memory->used(MemoryUse::films);
  }
  // The memory that the scene needs. During an edit, the parts that it changes exist twice.
  const auto memory = std::make_shared<MemoryBudget>(most * 21 / 20);
  const auto renderer = makeCpuRenderer(volume, 0, memory);
  edit(20);
  renderer->setScene(scene);
  renderer->renderSample(kNever);
  const Image before = renderer->image();
  const std::uint64_t used = memory->used(MemoryUse::grids);
  edit(21);
  try {
    renderer->setScene(scene);
    ADD_FAILURE() << "there is memory for both";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::busy);
  }
  EXPECT_EQ(memory->used(MemoryUse::grids), used);
  EXPECT_TRUE(sameBits(before, renderer->image()));
  renderer->renderSample(kNever);
  EXPECT_EQ(renderer->samples(), 2u);
}

TEST(CpuRenderer, GivesTheMemoryOfALargerFilmBackWhenItIsStopped) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.width = scene.height = 64;
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(256) << 20);
  const auto renderer = makeCpuRenderer(volume, 0, memory);
  renderer->setScene(scene);
  const auto before = memory->used(MemoryUse::films);
  Scene large = scene;
  large.width = large.height = 1024;
  large.macrocell = 3;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(renderer->setScene(large, stop.get_token()), Error);
  EXPECT_EQ(memory->used(MemoryUse::films), before);
}

TEST(CpuRenderer, TellsWhichScenesTakeLong) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.method = Method::superposed;
  const auto renderer = makeCpuRenderer(volume, 0);
  EXPECT_TRUE(renderer->takesLong(scene));
  renderer->setScene(scene);
  EXPECT_FALSE(renderer->takesLong(scene));
  const auto with = [&](auto change) {
    Scene other = scene;
    change(other);
    return renderer->takesLong(other);
  };
  EXPECT_FALSE(with([](Scene& s) { s.channels[0].density *= 2; }));
  EXPECT_FALSE(with([](Scene& s) { s.width *= 2; }));
  EXPECT_FALSE(with([](Scene& s) { s.channels[0].opacity.assign(1000, {0.5, 1}); }));
  EXPECT_TRUE(with([](Scene& s) { s.channels[0].opacity.assign(3000, {0.5, 1}); }));
  EXPECT_TRUE(with([](Scene& s) { s.macrocell = 2; }));
  EXPECT_TRUE(with([](Scene& s) { s.method = Method::automatic; }));
  EXPECT_TRUE(with([](Scene& s) { s.width = s.height = 1024; }));
  // A smaller picture takes as many bytes if more values are kept for each pixel.
  EXPECT_FALSE(with([](Scene& s) { s.width = s.height = 900; }));
  EXPECT_FALSE(renderer->filmIsLarge());
  renderer->recordAovs();
  EXPECT_FALSE(renderer->filmIsLarge());
  EXPECT_TRUE(with([](Scene& s) { s.width = s.height = 900; }));
  scene.width = scene.height = 900;
  renderer->setScene(scene);
  EXPECT_TRUE(renderer->filmIsLarge());
}

TEST(CpuRenderer, SpendsNothingOnChannelsThatCannotBeSeen) {
  const auto volume = orbitals();
  const auto fetchesOf = [&](const Scene& scene) {
    const auto renderer = makeCpuRenderer(volume, 2);
    renderer->countCosts();
    renderer->setScene(scene);
    renderer->renderSample(kNever);
    return renderer->stats().fetches;
  };
  Scene one = orbitalScene(*volume);
  one.channels[0].visible = one.channels[2].visible = false;
  Scene transparent = orbitalScene(*volume);
  transparent.channels[0].opacity = {{0, 0}};
  transparent.channels[2].density = 0;
  EXPECT_EQ(fetchesOf(one), fetchesOf(transparent));
  EXPECT_LT(fetchesOf(one), fetchesOf(orbitalScene(*volume)));
  Scene none = orbitalScene(*volume);
  for (auto& channel : none.channels) channel.visible = false;
  EXPECT_EQ(fetchesOf(none), 0u);
}

TEST(CpuRenderer, EstimatesTheErrorThatIsThere) {
  // Over 1850 pixels, estimate and true error agree to a few percent, for independent samples and for
  // replicates of dependent ones.
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.filter = PixelFilter::point;  // where the reference is exact
  const Image truth = reference::renderReference(*volume, scene, 1).image;
  const auto ratioAt = [&](Sampling sampling, int samples) {
    scene.sampling = sampling;
    const auto renderer = makeCpuRenderer(volume, 2);
    renderer->setScene(scene);
    for (int i = 0; i < samples; ++i) renderer->renderSample(kNever);
    return renderer->estimatedError() / compareImages(renderer->image(), truth).rmse;
  };
  EXPECT_NEAR(ratioAt(Sampling::independent, 16), 1, 0.1);
  EXPECT_NEAR(ratioAt(Sampling::lowDiscrepancy, 1024), 1, 0.1);
  // Too few replicates: the estimate is too high, never too low.
  EXPECT_GT(ratioAt(Sampling::lowDiscrepancy, 64), 1);
  EXPECT_TRUE(std::isnan(makeCpuRenderer(volume, 1)->estimatedError()));
}

}  // namespace
}  // namespace scolopax
