// SPDX-License-Identifier: Apache-2.0
#include "server/blend.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

namespace scolopax::server {
namespace {

Image constant(int width, int height, float value) {
  return {width, height, std::vector<glm::vec4>(std::size_t(width) * std::size_t(height), glm::vec4(value))};
}

TEST(Blend, EnlargesALinearRampExactlyAboutTheCentre) {
  // A pixel of 134 x 100 is as large as 3 x 3 pixels of 400 x 300; the small picture is 402 of those wide,
  // one more on each side.
  Image small{134, 100, {}};
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 134; ++x)
      small.pixels.emplace_back(3 * (float(x) + 0.5f) - 1, 3 * (float(y) + 0.5f), 0, 1);
  const Image full = enlarged(small, 400, 300);
  ASSERT_EQ(full.pixels.size(), 400u * 300u);
  for (int y = 2; y < 298; ++y)
    for (int x = 2; x < 398; ++x) {
      const glm::vec4 p = full.pixels[std::size_t(y * 400 + x)];
      ASSERT_NEAR(p.r, x + 0.5, 1e-3) << x;
      ASSERT_NEAR(p.g, y + 0.5, 1e-3) << y;
      ASSERT_NEAR(p.a, 1, 1e-6);
    }
}

TEST(Blend, EnlargesOnePixelToAll) {
  const Image full = enlarged(constant(1, 1, 0.25f), 3, 2);
  EXPECT_EQ(full.pixels, constant(3, 2, 0.25f).pixels);
}

TEST(Blend, TakesAllOfAPictureWithoutError) {
  Image image = constant(2, 2, 1);
  EXPECT_EQ(mixIn(constant(2, 2, 0), 0, &image), 1);
  EXPECT_EQ(image.pixels, constant(2, 2, 1).pixels);
  EXPECT_EQ(mixIn(constant(2, 2, 1), 0.5, &image), 1);  // the pictures are equal, so any share is right
}

TEST(Blend, TakesNothingOfAPictureThatIsAllNoise) {
  Image image = constant(2, 2, 1);
  EXPECT_EQ(mixIn(constant(2, 2, 0), 2, &image), 0);
  EXPECT_EQ(image.pixels, constant(2, 2, 0).pixels);
}

TEST(Blend, LooksAtAlphaAsErrorDoes) {
  // The error explains half of the squared difference: equal shares of both.
  Image image{1, 1, {{0, 0, 0, 1}}};
  EXPECT_NEAR(mixIn({1, 1, {{0, 0, 0, 0}}}, std::sqrt(0.5 / 4), &image), 0.5, 1e-12);
}

TEST(Blend, OfTwoNoisyPicturesIsBetterThanBothByTheLawOfIndependentErrors) {
  std::mt19937 random(7);
  for (const double errorBefore : {0.01, 0.1, 1.0})
    for (const double error : {0.01, 0.1, 1.0}) {
      std::normal_distribution<float> noiseBefore(0, float(errorBefore)), noise(0, float(error));
      Image before{200, 200, {}}, image{200, 200, {}};  // the truth is 0
      for (int i = 0; i < 200 * 200; ++i) {
        before.pixels.emplace_back(noiseBefore(random), noiseBefore(random), noiseBefore(random),
                                   noiseBefore(random));
        image.pixels.emplace_back(noise(random), noise(random), noise(random), noise(random));
      }
      mixIn(before, error, &image);
      double squares = 0;
      for (const glm::vec4& p : image.pixels) squares += double(glm::dot(p, p));
      const double best = 1 / std::sqrt(1 / (error * error) + 1 / (errorBefore * errorBefore));
      // From 160,000 numbers the variance is known to 0.4 % (1 sigma), and so the share to 1.2 % (3 sigma).
      EXPECT_GT(std::sqrt(squares / (4 * 200 * 200)), 0.99 * best) << errorBefore << " " << error;
      EXPECT_LT(std::sqrt(squares / (4 * 200 * 200)), 1.01 * std::hypot(best, 0.012 * error))
          << errorBefore << " " << error;
    }
}

}  // namespace
}  // namespace scolopax::server
