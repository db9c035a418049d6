// SPDX-License-Identifier: Apache-2.0
#include "renderer/metrics/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "renderer/core/error.h"

namespace scolopax {
namespace {

Image makeImage(int width, int height, glm::vec4 value) {
  return {width, height, std::vector<glm::vec4>(std::size_t(width) * std::size_t(height), value)};
}

TEST(ImageDifference, OfEqualPicturesIsZeroWithInfinitePsnr) {
  const Image image = makeImage(3, 2, {0.25f, 0.5f, 0.75f, 1});
  const ImageDifference d = compareImages(image, image);
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.maximum, 0);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
}

TEST(ImageDifference, HasTheValuesComputedByHand) {
  Image a = makeImage(2, 1, {0, 0, 0, 0}), b = a;
  // Squared differences 0.25, 0.0625, 0, 0.25 and 1, 0, 0.0625, 0: their mean over 8 components is 1.625 / 8.
  a.pixels[0] = {0.5f, 0.25f, 0.125f, 0.5f};
  b.pixels[0] = {1.0f, 0.0f, 0.125f, 1};
  a.pixels[1] = {2.0f, 0.5f, 0.5f, 1};
  b.pixels[1] = {1.0f, 0.5f, 0.75f, 1};
  const ImageDifference d = compareImages(a, b);
  EXPECT_NEAR(d.rmse, 0.45069390943299864, 1e-15);
  EXPECT_NEAR(d.psnr, 6.922366, 1e-6);
  EXPECT_EQ(d.maximum, 1.0);
}

TEST(ImageDifference, OfAUniformTenthIsTwentyDecibels) {
  const ImageDifference d = compareImages(makeImage(5, 7, {0, 0, 0, 0}), makeImage(5, 7, glm::vec4(0.1f)));
  EXPECT_NEAR(d.rmse, 0.1, 1e-8);
  EXPECT_NEAR(d.psnr, 20, 1e-6);
  EXPECT_NEAR(d.maximum, 0.1, 1e-8);
}

TEST(ImageDifference, RelativeErrorHasTheValueComputedByHand) {
  Image a = makeImage(2, 1, {0, 0, 0, 0}), b = a;
  // The second picture is the reference: 0.25 / 0.26, 0.01 / 0.01, 0, 0, and 1 / 4.01, 0, 0, 0.
  a.pixels[0] = {1.0f, 0.1f, 0.7f, 1};
  b.pixels[0] = {0.5f, 0.0f, 0.7f, 1};
  a.pixels[1] = {1.0f, 0.25f, 0.0f, 1};
  b.pixels[1] = {2.0f, 0.25f, 0.0f, 1};
  EXPECT_NEAR(compareImages(a, b).relative, (0.9615384615384616 + 1 + 0.24937655860349128) / 8, 1e-7);
  EXPECT_NEAR(compareImages(b, a).relative, (0.25 / 1.01 + 0.01 / 0.02 + 1 / 1.01) / 8, 1e-7);
  EXPECT_EQ(compareImages(a, a).relative, 0);
}

TEST(ImageDifference, CountsAlphaAsMuchAsAColor) {
  // Black matter over a bright background: it differs only in alpha.
  const ImageDifference d = compareImages(makeImage(2, 2, {0, 0, 0, 0}), makeImage(2, 2, {0, 0, 0, 1}));
  EXPECT_EQ(d.rmse, 0.5);
  EXPECT_EQ(d.maximum, 1);
  EXPECT_NEAR(d.relative, 1 / 1.01 / 4, 1e-7);
}

TEST(ImageDifference, IsSymmetric) {
  const Image a = makeImage(2, 2, {0.1f, 0.9f, 0.3f, 1}), b = makeImage(2, 2, {0.7f, 0.2f, 0.4f, 1});
  EXPECT_EQ(compareImages(a, b).rmse, compareImages(b, a).rmse);
  EXPECT_EQ(compareImages(a, b).maximum, compareImages(b, a).maximum);
}

TEST(ImageDifference, NeverPassesOverAPixelThatIsNotFinite) {
  Image a = makeImage(3, 1, glm::vec4(0)), b = a;
  a.pixels[1].y = std::numeric_limits<float>::quiet_NaN();
  b.pixels[2].x = 0.5f;
  EXPECT_TRUE(std::isnan(compareImages(a, b).rmse));
  EXPECT_TRUE(std::isnan(compareImages(a, b).psnr));
  EXPECT_TRUE(std::isnan(compareImages(a, b).maximum));
  EXPECT_TRUE(std::isnan(compareImages(a, b).relative));
  a.pixels[1].y = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(std::isinf(compareImages(a, b).rmse));
  EXPECT_TRUE(std::isinf(compareImages(a, b).maximum));
  EXPECT_TRUE(std::isinf(compareImages(a, b).relative));
  EXPECT_TRUE(std::isinf(compareImages(b, a).relative));
  a.pixels[1] = {0, 0, 0, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_TRUE(std::isnan(compareImages(a, b).rmse));
}

TEST(ImageDifference, RefusesDifferentSizesAndNamesBoth) {
  try {
    compareImages(makeImage(3, 2, {}), makeImage(2, 3, {}));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::badInput);
    EXPECT_NE(std::string(error.what()).find("3x2"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("2x3"), std::string::npos);
  }
}

TEST(ImageDifference, RefusesPicturesWithoutPixels) { EXPECT_THROW(compareImages({}, {}), Error); }

}  // namespace
}  // namespace scolopax
