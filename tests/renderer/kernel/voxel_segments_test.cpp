// SPDX-License-Identifier: Apache-2.0
// Segments of dense matter are short where their light is visible, and longer where less of it is visible.
#include "renderer/kernel/voxel_segments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "renderer/data/render_plan.h"
#include "renderer/kernel/render_pixel.h"
#include "tests/support/volumes.h"

namespace scolopax::kernel {
namespace {

using namespace test;

/// The optical depths of the segments of a ray through constant matter, of which a share `left` is visible.
std::vector<float> depthsOfSegments(const SceneView& view, float extinction, float left, float most) {
  const SampleNumber number{};
  Sampler sampler(0, number, 1);
  const PixelRay<One> at = rayThrough<One>(view, 0, 0, sampler, true);
  SegmentCubics<One, SceneView> scalars;
  SampleCost cost;
  VoxelSegments<One, SceneView> along(scalars, view, at.ray, at.inside, 1u, 0.0f, kInfinity, &cost);
  std::vector<float> depths;
  Segment<One> segment;
  for (bool more = true; more;) {
    more = along.next(segment);
    while (along.shorten(segment, extinction * segment.length(), left, most)) continue;
    if (segment.length() > 0) depths.push_back(extinction * segment.length());
  }
  return depths;
}

TEST(VoxelSegments, MayBeTheLongerTheLessOfTheirLightIsSeen) {
  const glm::ivec3 dims(2, 2, 9);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.filter = PixelFilter::point;
  scene.step = 0;
  scene.channels = {solid(100)};
  const RenderPlan plan(volume, scene, nullptr);
  std::size_t before = std::size_t(100 * 9 / 0.02);
  for (const float left : {1.0f, 0x1p-4f, 0x1p-8f, 0x1p-12f}) {
    const auto depths = depthsOfSegments(plan.view(), 100, left, 0.02f);
    const float most = 0.02f / std::sqrt(std::sqrt(left));
    double sum = 0;
    for (const float depth : depths) {
      EXPECT_LE(depth, most * 1.0001f);
      sum += double(depth);
    }
    EXPECT_NEAR(sum, 900, 0.1);
    EXPECT_LT(double(depths.size()), double(before) * (left < 1 ? 0.55 : 2.5)) << left;
    before = depths.size();
  }
}

}  // namespace
}  // namespace scolopax::kernel
