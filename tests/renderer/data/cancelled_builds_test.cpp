// SPDX-License-Identifier: Apache-2.0
// Every stage of a build whose time grows with the number of macrocells ends when it is cancelled.
#include <gtest/gtest.h>

#include <array>

#include "renderer/core/error.h"
#include "renderer/data/bound_columns.h"
#include "renderer/data/majorant_grid.h"
#include "renderer/data/render_plan.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

/// Whether build(stop) throws Error(cancelled) if `stop` has been requested, and does not throw otherwise.
template <class Build>
bool endsWhenToldTo(Build build) {
  std::stop_source stop;
  build(stop.get_token());
  stop.request_stop();
  try {
    build(stop.get_token());
  } catch (const Error& error) {
    return error.code() == ErrorCode::cancelled;
  }
  return false;
}

std::shared_ptr<const Volume> slantedRamp() {
  const glm::ivec3 dims(12);
  return volumeOf(gridOf(dims),
                  channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return x + 5 * y + 9 * z; }));
}

TEST(CancelledBuilds, EndInEveryStage) {
  const auto volume = slantedRamp();
  const Channel& channel = volume->channels()[0];
  const auto macrocells = std::make_shared<const MacrocellGrid>(buildMacrocells(*volume, 2));
  ChannelAppearance look;
  look.rangeHi = 255;
  const auto table = buildBounds(macrocells->levels[0], TransferFunction(channel, look), 0);
  const auto gradients = buildGradientCells(*volume, 0, 2, Interpolation::trilinear);
  const GradientFactor factor(GradientOpacity{0, 20, {{0, 0}, {1, 1}}}, channel, volume->grid());
  EXPECT_TRUE(endsWhenToldTo([&](const std::stop_token& stop) {
    buildBoundColumn(*macrocells, 0, table, gradients, factor, nullptr, stop);
  }));
  const std::array column{buildBoundColumn(*macrocells, 0, table, gradients, factor)};
  EXPECT_TRUE(
      endsWhenToldTo([&](const std::stop_token& stop) { withColumns(macrocells, column, nullptr, stop); }));
  EXPECT_TRUE(endsWhenToldTo([&](const std::stop_token& stop) {
    MajorantGrid(macrocells, {table}, true, false, nullptr, nullptr, stop);
  }));
}

TEST(CancelledBuilds, EndWhereAnEditNeedsNoMeasurement) {
  Scene scene;
  scene.width = scene.height = 8;
  scene.channels.resize(1);
  scene.channels[0].rangeHi = 255;
  const auto volume = slantedRamp();
  const RenderPlan before(volume, scene);
  scene.channels[0].opacity = {{0, 0.5}, {1, 1}};
  EXPECT_TRUE(endsWhenToldTo(
      [&](const std::stop_token& stop) { RenderPlan(volume, scene, &before, nullptr, stop); }));
}

}  // namespace
}  // namespace scolopax
