// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/clip_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "renderer/core/error.h"
#include "renderer/kernel/clip.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr int kVisible[] = {1, 4, 5};  // of the volume's channels

std::optional<kernel::ClipView> viewOf(const std::vector<ClipPlane>& planes,
                                       const std::optional<Crop>& crop) {
  return clipView(planes, crop, gridOf({10, 10, 10}), kVisible);
}

TEST(ClipView, OfNoClippingIsTheVolumesBox) {
  const auto view = viewOf({}, std::nullopt);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->low, glm::vec3(-0.5f));
  EXPECT_EQ(view->high, glm::vec3(9.5f));
  EXPECT_EQ(view->planeCount, 0);
  EXPECT_FALSE(view->parts);
}

TEST(ClipView, OfRegionsThatAreABoxIsThatBox) {
  for (const auto& [regions, low, high] :
       {std::tuple{Crop::kInnermost, 2.0f, 6.0f}, {7u << 12, 2.0f, 6.0f}, {0x7ffffffu, -0.5f, 9.5f}}) {
    const auto view = viewOf({}, Crop{glm::dvec3(2), glm::dvec3(6), regions});
    ASSERT_TRUE(view);
    EXPECT_FALSE(view->parts) << regions;
    EXPECT_EQ(view->low.z, low) << regions;
    EXPECT_NEAR(view->high.z, high, 1e-6) << regions;
  }
  // Two neighbouring regions, one of which has no volume: still a box.
  const auto view = viewOf({}, Crop{glm::dvec3(-0.5, 2, 2), glm::dvec3(9.5, 6, 6), 5u << 12});
  EXPECT_FALSE(view);
  EXPECT_TRUE(viewOf({}, Crop{glm::dvec3(2), glm::dvec3(6), 5u << 12})->parts);
}

TEST(ClipView, TellsPlanesOfAllVisibleChannelsFromThoseOfSome) {
  const auto view = viewOf({{{0, 0, 3}, {0, 0, 1}, std::vector<int>{4}},
                            {{0, 0, 2}, {0, 0, 1}, {}},
                            {{0, 0, 1}, {0, 0, 1}, std::vector<int>{0, 2, 3}},
                            {{0, 0, 1}, {0, 2, 0}, std::vector<int>{1, 4, 5}}},
                           std::nullopt);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->wholePlanes, 2);
  EXPECT_EQ(view->planeCount, 3);  // one plane clips only invisible channels
  EXPECT_EQ(view->planes[2].channels, 2u);
  EXPECT_TRUE(view->parts);
}

TEST(ClipView, LeavesOfARayTheSamePartsAsOfItsPoints) {
  const auto view = viewOf({{{0, 0, 3.3}, {0.1, 0.2, 1}, std::vector<int>{4}},
                            {{5.2, 0, 0}, {-1, 0.3, 0.4}, std::vector<int>{1, 5}}},
                           Crop{{2, 2.5, 3}, {7, 6.5, 8}, 0x5a3c96bu});
  ASSERT_TRUE(view);
  kernel::SceneView scene{};
  scene.clip = *view;
  for (const glm::vec3 direction :
       {glm::vec3(1, 0.3f, 0.2f), glm::vec3(0, 0, -1), glm::vec3(-0.5f, 0.5f, 0.7f)}) {
    const kernel::Ray ray{glm::vec3(4.6f, 4.4f, 4.2f) - 12.0f * direction, direction};
    const auto inside = kernel::clipToScene(scene, ray);
    kernel::Spans<kernel::One> spans(scene, ray, inside, 7);
    float reached = inside.enter;
    int parts = 0;
    while (!spans.done(true)) {
      const auto span = spans.next(true);
      ASSERT_GE(span.enter, reached);  // parts without a channel are left out
      ASSERT_LT(++parts, 20);
      reached = span.exit;
      for (const float share : {0.01f, 0.3f, 0.99f}) {
        const float t = span.enter + share * (span.exit - span.enter);
        if (span.enter < span.exit) {
          EXPECT_EQ(span.channels, kernel::channelsAt<kernel::One>(*view, ray.origin + t * ray.direction))
              << t;
        }
      }
    }
    EXPECT_LE(reached, inside.exit);
    EXPECT_GT(parts, 2);
  }
}

TEST(Clipping, ThatCannotBeIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto check = [](const std::vector<ClipPlane>& planes, const std::optional<Crop>& crop = {}) {
    checkClipping(planes, crop, 3);
  };
  EXPECT_NO_THROW(check({{{1, 2, 3}, {0, 0, 1e-300}, std::vector<int>{0, 2}}}));
  EXPECT_THROW(check({{{1, 2, 3}, {0, 0, 0}, {}}}), Error);
  EXPECT_THROW(check({{{1, nan, 3}, {0, 0, 1}, {}}}), Error);
  EXPECT_THROW(check({{{1, 2, 1e300}, {0, 0, 1}, {}}}), Error);
  EXPECT_THROW(check({{{1, 2, 3}, {0, HUGE_VAL, 1}, {}}}), Error);
  EXPECT_THROW(check({{{1, 2, 3}, {0, 0, 1}, std::vector<int>{3}}}), Error);
  EXPECT_THROW(check({{{1, 2, 3}, {0, 0, 1}, std::vector<int>{-1}}}), Error);
  EXPECT_THROW(check(std::vector<ClipPlane>(9)), Error);
  EXPECT_THROW(check({}, Crop{{0, 3, 0}, {1, 2, 3}, 0}), Error);
  EXPECT_THROW(check({}, Crop{{0, nan, 0}, {1, 2, 3}, 0}), Error);
}

}  // namespace
}  // namespace scolopax
