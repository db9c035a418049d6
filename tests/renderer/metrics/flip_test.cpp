// SPDX-License-Identifier: Apache-2.0
// Expected values are computed by hand from the paper's formulas, in one dimension or without spatial
// filters; none are published for pictures this small.
#include "renderer/metrics/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <limits>
#include <random>

#include "renderer/core/error.h"

namespace scolopax {
namespace {

Image constant(int width, int height, glm::vec3 color) {
  return {width, height,
          std::vector<glm::vec4>(std::size_t(width) * std::size_t(height), glm::vec4(color, 1.0f))};
}

/// The paper's error of two colours, written again without spatial filters, which leave constant pictures
/// unchanged.
struct Lab {
  double l, a, b;
};
Lab huntLab(double r, double g, double b) {
  // sRGB to XYZ of D65, to four digits as in IEC 61966-2-1; over the white of the same matrix.
  const double x = (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505, y = 0.2126 * r + 0.7152 * g + 0.0722 * b,
               z = (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0890;
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787037 * t + 16.0 / 116; };
  const double l = 116 * f(y) - 16;
  return {l, 0.01 * l * 500 * (f(x) - f(y)), 0.01 * l * 200 * (f(y) - f(z))};
}
double distance(const Lab& p, const Lab& q) {
  const double d = std::abs(p.l - q.l) + std::sqrt(std::pow(p.a - q.a, 2) + std::pow(p.b - q.b, 2));
  return std::pow(d, 0.7);
}
double byHand(glm::vec3 p, glm::vec3 q) {
  const double largest = distance(huntLab(0, 1, 0), huntLab(0, 0, 1)), knee = 0.4 * largest;
  const double d = distance(huntLab(p.x, p.y, p.z), huntLab(q.x, q.y, q.z));
  return d < knee ? 0.95 * d / knee : 0.95 + 0.05 * (d - knee) / (largest - knee);
}

TEST(Flip, OfEqualPicturesIsZero) {
  Image image = constant(13, 7, {0.2f, 0.9f, 0.4f});
  image.pixels[20] = {1, 0, 0.5f, 1};
  const Flip flip = flipDifference(image, image);
  EXPECT_EQ(flip.mean, 0);
  EXPECT_EQ(flip.errors, std::vector<float>(13 * 7, 0.0f));
}

TEST(Flip, OfBlackAndWhiteIsJustBelowOne) {
  // Lightness differs by 100, and 100^0.7 = 25.1189; from green to blue it is 41.276, whose 0.4th is 16.510:
  // 0.95 + 0.05 (25.1189 - 16.510) / (41.276 - 16.510).
  const Flip flip = flipDifference(constant(9, 5, glm::vec3(0)), constant(9, 5, glm::vec3(1)));
  EXPECT_NEAR(flip.mean, 0.96738, 1e-5);
  for (const float error : flip.errors) EXPECT_NEAR(error, 0.96738, 1e-5);
}

TEST(Flip, OfGreenAndBlueIsOne) {
  EXPECT_NEAR(flipDifference(constant(4, 4, {0, 1, 0}), constant(4, 4, {0, 0, 1})).mean, 1, 1e-9);
}

TEST(Flip, OfConstantColoursIsTheFormulaWithoutSpace) {
  const glm::vec3 pairs[][2] = {{{0.5f, 0.5f, 0.5f}, {0.6f, 0.5f, 0.4f}},
                                {{1, 0, 0}, {0, 1, 0}},
                                {{0.02f, 0.02f, 0.02f}, {0, 0, 0}},
                                {{0.001f, 0.002f, 0.003f}, {0.002f, 0.002f, 0.002f}},
                                {{1, 1, 0}, {0, 1, 1}},
                                {{0.9f, 0.1f, 0.3f}, {0.8f, 0.2f, 0.3f}}};
  for (const auto& pair : pairs) {
    const double expected = byHand(pair[0], pair[1]);
    EXPECT_GT(expected, 0.002);
    EXPECT_NEAR(flipDifference(constant(6, 3, pair[0]), constant(6, 3, pair[1])).mean, expected, 5e-4);
  }
}

TEST(Flip, ClipsToWhatAScreenShows) {
  EXPECT_EQ(flipDifference(constant(3, 3, {7, -2, 1}), constant(3, 3, {1, 0, 1})).mean, 0);
}

TEST(Flip, DoesNotDependOnTheOrder) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  Image a = constant(24, 17, {}), b = a;
  for (auto* image : {&a, &b})
    for (glm::vec4& p : image->pixels) p = {unit(random), unit(random), unit(random), 1};
  const Flip ab = flipDifference(a, b), ba = flipDifference(b, a);
  EXPECT_EQ(ab.errors, ba.errors);
  EXPECT_GT(ab.mean, 0.05);
  for (const float error : ab.errors) EXPECT_TRUE(error >= 0 && error <= 1);
}

TEST(Flip, IsTheSameAlongBothAxes) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> unit(0, 1);
  Image a = constant(20, 14, {}), b = a, at = constant(14, 20, {}), bt = at;
  for (std::size_t y = 0; y < 14; ++y)
    for (std::size_t x = 0; x < 20; ++x) {
      a.pixels[x + 20 * y] = at.pixels[y + 14 * x] = {unit(random), unit(random), unit(random), 1};
      b.pixels[x + 20 * y] = bt.pixels[y + 14 * x] = {unit(random), unit(random), unit(random), 1};
    }
  EXPECT_NEAR(flipDifference(a, b).mean, flipDifference(at, bt).mean, 1e-12);
}

/// The left half black and the right half white, against black: a problem in one dimension, without colour.
TEST(Flip, OfAnEdgeHasTheValueWorkedOutByHand) {
  const double ppd = 67, sd = 0.5 * 0.082 * ppd;
  Image edge = constant(60, 3, glm::vec3(0));
  for (std::size_t i = 0; i < edge.pixels.size(); ++i)
    if (i % 60 >= 30) edge.pixels[i] = glm::vec4(1);
  const Flip flip = flipDifference(edge, constant(60, 3, glm::vec3(0)));
  for (int pixel = 26; pixel < 34; ++pixel) {
    // Parts of the filters that lie on white, i >= 30 - pixel.
    double gauss = 0, white = 0, edgeSum = 0, edgeAll = 0, pointSum = 0, positive = 0, negative = 0;
    for (int i = -10; i <= 10; ++i) {
      const double w = std::exp(-std::pow(3.14159265358979 * i / ppd, 2) / 0.0047);
      gauss += w;
      if (i >= 30 - pixel) white += w;
    }
    const auto point = [&](int i) { return (i * i / (sd * sd) - 1) * std::exp(-i * i / (2 * sd * sd)); };
    for (int i = -9; i <= 9; ++i) {
      if (i > 0) edgeAll += i * std::exp(-i * i / (2 * sd * sd));
      (point(i) > 0 ? positive : negative) += point(i);
    }
    for (int i = 30 - pixel; i <= 9; ++i) {
      edgeSum += i * std::exp(-i * i / (2 * sd * sd)) / edgeAll;
      pointSum += point(i) / (point(i) > 0 ? positive : -negative);
    }
    const float gray = float(white / gauss);
    const double color = byHand(glm::vec3(gray), glm::vec3(0));
    const double feature = std::max(std::abs(edgeSum), std::abs(pointSum));
    const double expected = std::pow(color, 1 - std::sqrt(feature / std::sqrt(2.0)));
    EXPECT_NEAR(flip.errors[std::size_t(60 + pixel)], expected, 5e-4) << pixel;
    if (pixel == 29 || pixel == 30) {
      EXPECT_NEAR(feature, 1, 1e-12);
    }
  }
  EXPECT_EQ(flip.errors[60 + 15], 0);  // beyond all filters
  EXPECT_NEAR(flip.errors[60 + 50], 0.96738, 1e-5);
}

/// One pixel of a random picture, by sums over complete two-dimensional filters in the paper's form.
struct DirectPixel {
  const Image& image;
  int x, y;

  glm::dvec3 at(int dx, int dy) const {
    const int px = std::clamp(x + dx, 0, image.width - 1), py = std::clamp(y + dy, 0, image.height - 1);
    const glm::vec4& p = image.pixels[std::size_t(px + image.width * py)];
    const double white[3] = {0.9505, 1, 1.0890};
    const double X = (0.4124 * p.x + 0.3576 * p.y + 0.1805 * p.z) / white[0];
    const double Y = 0.2126 * p.x + 0.7152 * p.y + 0.0722 * p.z;
    const double Z = (0.0193 * p.x + 0.1192 * p.y + 0.9505 * p.z) / white[2];
    return {116 * Y - 16, 500 * (X - Y), 200 * (Y - Z)};
  }
  Lab color() const {
    const double a1[3] = {1, 1, 34.1}, b1[3] = {0.0047, 0.0053, 0.04}, a2[3] = {0, 0, 13.5},
                 b2[3] = {1e-5, 1e-5, 0.025}, pi = 3.14159265358979323846;
    glm::dvec3 sum(0), weights(0);
    for (int dy = -10; dy <= 10; ++dy)
      for (int dx = -10; dx <= 10; ++dx) {
        const double d2 = (dx * dx + dy * dy) / (67.0 * 67.0);
        for (int c = 0; c < 3; ++c) {
          const double w = a1[c] * std::sqrt(pi / b1[c]) * std::exp(-pi * pi * d2 / b1[c]) +
                           a2[c] * std::sqrt(pi / b2[c]) * std::exp(-pi * pi * d2 / b2[c]);
          weights[c] += w;
          sum[c] += w * at(dx, dy)[c];
        }
      }
    sum /= weights;
    const double Y = (sum.x + 16) / 116, X = (Y + sum.y / 500) * 0.9505, Z = (Y - sum.z / 200) * 1.0890;
    return huntLab(3.2406 * X - 1.5372 * Y - 0.4986 * Z, -0.9689 * X + 1.8758 * Y + 0.0415 * Z,
                   0.0557 * X - 0.2040 * Y + 1.0570 * Z);
  }
  double feature(bool edge) const {
    const double sd = 0.5 * 0.082 * 67;
    double positive = 0, negative = 0, sums[2][2] = {};
    for (int dy = -9; dy <= 9; ++dy)
      for (int dx = -9; dx <= 9; ++dx) {
        const double gauss = std::exp(-(dx * dx + dy * dy) / (2 * sd * sd));
        const double w = (edge ? -dx : dx * dx / (sd * sd) - 1) * gauss;
        (w > 0 ? positive : negative) += w;
        sums[0][w > 0] += w * (at(dx, dy).x + 16) / 116;
        sums[1][w > 0] += w * (at(dy, dx).x + 16) / 116;
      }
    const double alongX = sums[0][1] / positive - sums[0][0] / negative,
                 alongY = sums[1][1] / positive - sums[1][0] / negative;
    return std::sqrt(alongX * alongX + alongY * alongY);
  }
};

TEST(Flip, OfRandomColoursMatchesSumsOverWholeFilters) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> unit(0.3f, 0.7f);
  Image a = constant(26, 23, {}), b = a;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    a.pixels[i] = {unit(random), unit(random), unit(random), 1};
    // Blocks of colour on top of the noise, which the filters do not remove completely.
    b.pixels[i] =
        a.pixels[i] * (i % 26 < 12 ? glm::vec4(1.3f, 0.8f, 0.4f, 1) : glm::vec4(0.6f, 0.9f, 1.4f, 1));
  }
  const Flip flip = flipDifference(a, b);
  const double largest = distance(huntLab(0, 1, 0), huntLab(0, 0, 1)), knee = 0.4 * largest;
  for (const glm::ivec2& at : {glm::ivec2(0, 0), {11, 7}, {12, 20}, {25, 22}, {18, 3}}) {
    const DirectPixel p{a, at.x, at.y}, q{b, at.x, at.y};
    const double d = distance(p.color(), q.color());
    const double color = d < knee ? 0.95 * d / knee : 0.95 + 0.05 * (d - knee) / (largest - knee);
    const double feature =
        std::max(std::abs(p.feature(true) - q.feature(true)), std::abs(p.feature(false) - q.feature(false)));
    EXPECT_NEAR(flip.errors[std::size_t(at.x + 26 * at.y)],
                std::pow(color, 1 - std::sqrt(feature / std::sqrt(2.0))), 1e-3);
    EXPECT_GT(color, 0.1);
  }
}

TEST(Flip, OfASinglePixelIsFeltNearIt) {
  const Image gray = constant(41, 41, glm::vec3(0.2f));
  Image dotted = gray;
  dotted.pixels[20 + 41 * 20] = {0.8f, 0.8f, 0.8f, 1};
  const Flip flip = flipDifference(gray, dotted);
  const float most = *std::max_element(flip.errors.begin(), flip.errors.end());
  EXPECT_EQ(most, flip.errors[20 + 41 * 20]);
  EXPECT_GT(most, 0.05);
  EXPECT_LT(most, byHand(glm::vec3(0.2f), glm::vec3(0.8f)));
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 41; ++x)
      if (std::max(std::abs(x - 20), std::abs(y - 20)) > 10) {
        EXPECT_EQ(flip.errors[std::size_t(x + 41 * y)], 0);
      }
  // From a larger distance the difference is smaller.
  EXPECT_LT(flipDifference(gray, dotted, 200).errors[20 + 41 * 20], most);
}

TEST(Flip, SeesFeaturesThatColourAloneDoesNot) {
  // A checkerboard of single pixels with the same mean colour, which the eye resolves at 20 pixels per
  // degree.
  Image board = constant(40, 40, glm::vec3(0.3f));
  for (std::size_t i = 0; i < board.pixels.size(); ++i)
    if ((i % 40 + i / 40) % 2) board.pixels[i] = {0.5f, 0.5f, 0.5f, 1};
  const Image mean = constant(40, 40, glm::vec3(0.4f));
  EXPECT_GT(flipDifference(board, mean, 20).mean, flipDifference(board, mean, 200).mean);
}

TEST(Flip, NeverPassesOverANaN) {
  Image a = constant(5, 5, glm::vec3(0.5f));
  const Image b = a;
  a.pixels[12].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(flipDifference(a, b).mean));
}

TEST(Flip, RefusesOtherSizesAndDistances) {
  EXPECT_THROW(flipDifference(constant(3, 2, {}), constant(2, 3, {})), Error);
  EXPECT_THROW(flipDifference({}, {}), Error);
  for (const double bad : {0.0, -67.0, 1e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(flipDifference(constant(2, 2, {}), constant(2, 2, {}), bad), Error);
}

TEST(FlipPicture, GoesFromBlackToLightYellow) {
  const Image picture = flipPicture({{0, 0.5f, 1, std::numeric_limits<float>::quiet_NaN()}, 0.5}, 2, 2);
  ASSERT_EQ(picture.pixels.size(), 4u);
  EXPECT_LT(picture.pixels[0].x + picture.pixels[0].y + picture.pixels[0].z, 0.01f);
  EXPECT_GT(picture.pixels[1].x, picture.pixels[1].y);  // magma's middle is a red purple
  EXPECT_GT(picture.pixels[2].x, 0.9f);
  EXPECT_GT(picture.pixels[2].y, 0.9f);
  EXPECT_EQ(picture.pixels[3], picture.pixels[2]);
}

}  // namespace
}  // namespace scolopax
