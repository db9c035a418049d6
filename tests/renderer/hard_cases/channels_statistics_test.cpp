// SPDX-License-Identifier: Apache-2.0
// Numbers of channels, and relations between channels, with which drawing a channel may go wrong.
#include <gtest/gtest.h>

#include <utility>

#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

const glm::dvec3 kPalette[] = {kRed, kGreen, kBlue, {1, 1, 0}, {0, 1, 1}, {1, 0, 1}, kWhite};

template <class F>
std::shared_ptr<const Volume> manyChannels(int count, F&& fieldOf) {
  const glm::ivec3 dims(8, 8, 8);
  std::vector<ChannelSource> sources;
  for (int n = 0; n < count; ++n) sources.push_back(channelOf<float>(dims, fieldOf(n)));
  return std::make_shared<const Volume>(gridOf(dims), std::move(sources));
}

TEST(ChannelCounts, OfOneTwelveAndThirtyTwoMatchTheReference) {
  for (const int count : {1, 12, 32}) {
    const auto volume = manyChannels(count, [](int n) { return lumps(n); });
    Scene scene = viewFrom(*volume, {19, 14, -12}, {3.5, 3.5, 3.5}, 32, 20);
    for (int n = 0; n < count; ++n)
      scene.channels[std::size_t(n)] = ramp(0.1, 1, 1.5 / count, kPalette[n % std::ssize(kPalette)]);
    expectReference(volume, scene, 300);
    for (auto& channel : scene.channels) channel.visible = false;
    scene.channels[std::size_t(count / 2)].visible = true;
    scene.channels[std::size_t(count / 2)].density = 0.5;
    expectReference(volume, scene, 300);
  }
}

TEST(Channels, ThatAreIdenticalShareTheLightEqually) {
  for (const int count : {2, 3, 32}) {
    const auto volume = manyChannels(count, [](int) { return [](int, int, int z) { return z; }; });
    Scene scene = frontScene(*volume, 20, 20);
    for (int counted = 0;
         counted<count; counted += count> 3 ? 31 : 1) {  // with up to 3 channels, each in turn
      for (int n = 0; n < count; ++n)
        scene.channels[std::size_t(n)] = ramp(0, 7, 0.4 / count, n == counted ? kRed : kBlue);
      const double alpha = -std::expm1(-0.4 * 4);
      expectTrackersMatch(flat(scene, glm::dvec4(1.0 / count, 0, 1 - 1.0 / count, 1) * alpha), volume, scene,
                          500);
    }
  }
}

TEST(Channels, OfWhichOneIsOpaqueBehindOrInFrontOfManyThinOnes) {
  // Eleven thin red channels fill the box; a blue one with an optical thickness of at least 1200 fills its
  // rear or front half.
  for (const bool front : {false, true})
    for (const int place : {0, 11}) {
      const auto volume = manyChannels(
          12, [&](int n) { return [=](int, int, int z) { return n != place || (z < 4) == front ? 1 : 0; }; });
      Scene scene = frontScene(*volume, 20, 20);
      scene.macrocell = 1;  // otherwise there are a thousand null collisions before the step
      for (int n = 0; n < 12; ++n) scene.channels[std::size_t(n)] = ramp(0, 1, 0.01, kRed);
      scene.channels[std::size_t(place)] = ramp(0, 1, 300, kBlue);
      scene.channels[std::size_t(place)].opacity = {{0, 0}, {0.5, 0}, {0.5, 1}, {1, 1}};  // from 3.5 on
      const double before = front ? 0 : -std::expm1(-0.11 * 4), share = 0.11 / 300.11;
      const double red =
          before + (1 - before) * share;  // the thin channels have a share of the opaque half, too
      expectTrackersMatch(flat(scene, {red, 0, 1 - red, 1}), volume, scene, 100);
    }
}

TEST(Channels, OfVeryDifferentExtinctionShareTheLightByIt) {
  const auto volume = manyChannels(3, [](int) { return [](int, int, int) { return 1; }; });
  for (const double ratio : {1e-3, 1e-6, 1e-30}) {
    Scene scene = frontScene(*volume, 32, 32);
    scene.channels = {solid(0.1 * ratio, kRed), solid(0.1, kGreen), solid(0.05 * ratio, kBlue)};
    const double alpha = -std::expm1(-0.8 * (1 + 1.5 * ratio)), sum = 1 + 1.5 * ratio;
    expectTrackersMatch(flat(scene, glm::dvec4(ratio / sum, 1 / sum, 0.5 * ratio / sum, 1) * alpha), volume,
                        scene, 500);
  }
}

}  // namespace
}  // namespace scolopax
