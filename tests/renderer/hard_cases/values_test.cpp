// SPDX-License-Identifier: Apache-2.0
// Conversion of stored values to positions on the curves, for values and ranges that lose precision or
// meaning. All exact, or within the rounding of one float.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/data/field_view.h"
#include "renderer/data/transfer_function.h"
#include "renderer/kernel/classify.h"
#include "renderer/kernel/filters.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr double kUlp = 0x1p-23;

/// A row of voxels, and the kernels' position of each in a range.
class Row {
 public:
  template <class T>
  static Row of(std::vector<double> values, double slope = 1, double intercept = 0) {
    Row row;
    const auto at = [&](int x, int, int) { return values[std::size_t(x)]; };
    row.volume_ = volumeOf(gridOf({int(values.size()), 1, 1}),
                           channelOf<T>({int(values.size()), 1, 1}, at, slope, intercept));
    return row;
  }
  double sample(double x) const {
    return double(
        kernel::sampleTrilinear(fieldView(channel()), volume_->grid().dims, glm::vec3(float(x), 0, 0)));
  }
  double position(double x, double lo, double hi) const {
    const TransferFunction t = transfer(lo, hi);
    return double(kernel::curvePosition(t.view(channel()), float(sample(x))));
  }

 private:
  const Channel& channel() const { return volume_->channels()[0]; }
  TransferFunction transfer(double lo, double hi) const {
    ChannelAppearance a;
    a.rangeLo = lo;
    a.rangeHi = hi;
    return TransferFunction(channel(), a);
  }
  std::shared_ptr<const Volume> volume_;
};

TEST(Values, OfTheFullRangeOfEveryIntegerTypeReachBothEndsAndOneStepMore) {
  const Row bytes = Row::of<std::uint8_t>({0, 1, 127, 254, 255});
  const Row words = Row::of<std::uint16_t>({0, 1, 32768, 65534, 65535});
  const Row shorts = Row::of<std::int16_t>({-32768, -32767, 0, 32766, 32767});
  EXPECT_EQ(bytes.position(0, 0, 255), 0);
  EXPECT_EQ(bytes.position(4, 0, 255), 1);
  EXPECT_NEAR(bytes.position(1, 0, 255), 1.0 / 255, kUlp / 255);
  EXPECT_NEAR(bytes.position(3, 0, 255), 254.0 / 255, kUlp);
  EXPECT_EQ(words.position(0, 0, 65535), 0);
  EXPECT_EQ(words.position(4, 0, 65535), 1);
  EXPECT_NEAR(words.position(1, 0, 65535), 1.0 / 65535, kUlp / 65535);
  EXPECT_NEAR(words.position(3, 0, 65535), 65534.0 / 65535, kUlp);
  EXPECT_EQ(shorts.position(0, -32768, 32767), 0);
  EXPECT_EQ(shorts.position(4, -32768, 32767), 1);
  EXPECT_NEAR(shorts.position(1, -32768, 32767), 1.0 / 65535, kUlp / 65535);
  EXPECT_NEAR(shorts.position(2, -32768, 32767), 32768.0 / 65535, kUlp);
}

TEST(Values, FarFromZeroKeepTheResolutionOfTheirVoxels) {
  std::vector<double> values;
  for (int k = 0; k <= 16; ++k) values.push_back(1e6 + k * 0.0625);  // neighbouring floats
  const Row row = Row::of<float>(values);
  for (int k = 0; k <= 16; ++k) EXPECT_EQ(row.position(k, 1e6, 1e6 + 1), k / 16.0);
  for (double x = 0; x < 16; x += 0.3)  // values between two voxels are finer than floats
    EXPECT_NEAR(row.position(x, 1e6, 1e6 + 1), x / 16, 2 * kUlp);
  const std::vector<double> negative = {-1e6, -1e6 + 0.125};
  EXPECT_NEAR(Row::of<float>(negative).position(0.3, -1e6, -1e6 + 0.125), 0.3, kUlp);
  // Ends of a range that are not floats.
  EXPECT_NEAR(row.position(4, 1e6 + 0.03, 1e6 + 0.53), (0.25 - 0.03) / 0.5, 4 * kUlp);
  const Row kelvin = Row::of<float>({280, 295, 310});
  EXPECT_EQ(kelvin.position(0, 280, 310), 0);
  EXPECT_NEAR(kelvin.position(0.25, 280, 310), 0.125, kUlp);
  EXPECT_EQ(kelvin.position(1, 280, 310), 0.5);
  EXPECT_EQ(kelvin.position(2, 280, 310), 1);
  EXPECT_NEAR(kelvin.position(1, 294.9, 295.1), 0.5, 0.01 * kUlp + 2 * kUlp);
}

TEST(Values, AreMeasuredOverTheRangeGivenAlsoWhenItHoldsNeitherZeroNorOne) {
  const Row row = Row::of<float>({-7, -6, -5.5, -5, 0, 1, 5, 5.5, 6, 7});
  const double over[] = {0, 0, 0, 0, 0, 0, 0, 0.5, 1, 1}, under[] = {0, 0, 0.5, 1, 1, 1, 1, 1, 1, 1};
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(row.position(i, 5, 6), over[i]) << i;
    EXPECT_EQ(row.position(i, -6, -5), under[i]) << i;
    EXPECT_EQ(row.position(i, 6, 5), 1 - over[i]) << i;  // reversed
    EXPECT_EQ(row.position(i, -5, -6), 1 - under[i]) << i;
  }
}

TEST(Values, OfAnEmptyRangeAreBelowOrNot) {
  const float third = 1.0f / 3;
  const double below = double(std::nextafter(third, 0.0f)), above = double(std::nextafter(third, 1.0f));
  const Row row = Row::of<float>({-1e30, below, double(third), above, 1e30});
  const auto steps = [](const Row& r, double at) {
    std::string s;
    for (int i = 0; i < 5; ++i) {
      const double p = r.position(i, at, at);
      s += p == 0 ? '0' : p == 1 ? '1' : '?';
    }
    return s;
  };
  EXPECT_EQ(steps(row, double(third)), "00111");
  EXPECT_EQ(steps(row, 0.5 * (below + double(third))), "00111");  // between two floats
  EXPECT_EQ(steps(row, above), "00011");
  EXPECT_EQ(steps(row, 1.0 / 3), 1.0 / 3 > double(third) ? "00011" : "00111");
  const Row falling = Row::of<float>({1e30, -below, -double(third), -above, -1e30}, -1);  // the same data
  EXPECT_EQ(steps(falling, double(third)), "00111");
  const Row counts = Row::of<std::int16_t>({-32768, 19, 20, 21, 32767}, -0.5, 3);  // 16387 ... -16380.5
  EXPECT_EQ(steps(counts, -7), "11100");
}

TEST(Values, OfARangeTooNarrowForTheSlopeAndInterceptAreBelowOrNot) {
  const Row narrow = Row::of<float>({-1, 0, 1}, 1e20, 1);
  EXPECT_EQ(narrow.position(0, 1 - 1e-300, 1), 0);
  EXPECT_EQ(narrow.position(2, 1 - 1e-300, 1), 1);
  const Row far = Row::of<float>({-1, 0, 1}, 1, 1e16);
  EXPECT_EQ(far.position(0, 1e16, 1e16 + 0.5), 0);
  EXPECT_EQ(far.position(2, 1e16, 1e16 + 0.5), 1);
  const Row shifted = Row::of<float>({-2e16, -1e16, 0}, 1, 1e16);
  EXPECT_EQ(shifted.position(0, 0.25, 0.5), 0);  // both are -1e16 as stored values
  EXPECT_EQ(shifted.position(2, 0.25, 0.5), 1);
  EXPECT_EQ(shifted.position(0, 0.5, 0.25), 1);  // reversed
  EXPECT_EQ(shifted.position(2, 0.5, 0.25), 0);
}

TEST(Values, ThatAreTinyOrHugeKeepTheirPlaceInTheRange) {
  const Row tiny = Row::of<float>({0, 25 * kDenormal, 50 * kDenormal, 100 * kDenormal});
  EXPECT_EQ(tiny.position(0, 0, 100 * kDenormal), 0);
  EXPECT_NEAR(tiny.position(1, 0, 100 * kDenormal), 0.25, 2 * kUlp);
  EXPECT_NEAR(tiny.position(1.5, 0, 100 * kDenormal), 0.375, 2 * kUlp);
  EXPECT_EQ(tiny.position(3, 0, 100 * kDenormal), 1);
  const Row huge = Row::of<float>({-kLargest, -kLargest / 2, 0, kLargest});
  EXPECT_EQ(huge.position(0, -kLargest, kLargest), 0);
  EXPECT_EQ(huge.position(1, -kLargest, kLargest), 0.25);
  EXPECT_EQ(huge.position(2, -kLargest, kLargest), 0.5);
  EXPECT_EQ(huge.position(2.5, -kLargest, kLargest), 0.75);
  EXPECT_EQ(huge.position(3, -kLargest, kLargest), 1);
  EXPECT_EQ(huge.position(3, 0, 1e-30), 1);
  EXPECT_EQ(huge.position(0, 0, 1e-30), 0);
}

TEST(Values, BesideAFillValueKeepTheirPlaceInTheRange) {
  for (const double fill : {kLargest, -kLargest, -1e20, 9.97e36, -9999.0}) {
    const Row row = Row::of<float>({0, 0.25, 1e-3, 1, 0.7, fill, 0.3});
    EXPECT_EQ(row.position(1, 0, 1), 0.25);
    EXPECT_NEAR(row.position(2, 0, 1), 1e-3, 1e-3 * kUlp);
    EXPECT_EQ(row.position(3, 0, 1), 1);
    EXPECT_NEAR(row.position(2, 0, 2e-3), 0.5, kUlp);
    // The last voxel's value fills the half voxel beyond it.
    for (const double x : {6.0, 6.2, 6.5}) EXPECT_NEAR(row.position(x, 0, 1), 0.3, kUlp) << fill;
    const Row turned = Row::of<float>({0.3, fill});
    for (const double x : {-0.5, 0.0}) EXPECT_NEAR(turned.position(x, 0, 1), 0.3, kUlp) << fill;
  }
}

TEST(Values, ThatNoDoubleCouldHoldAreRefused) {
  const glm::ivec3 dims(2, 2, 2);
  const auto ends = [](int x, int, int) { return x == 0 ? -32768 : 32767; };
  const auto load = [&](double slope, double intercept) {
    volumeOf(gridOf(dims), channelOf<std::int16_t>(dims, ends, slope, intercept));
  };
  EXPECT_NO_THROW(load(1e290, 1e290));
  EXPECT_THROW(load(1e307, 0), Error);
  EXPECT_THROW(load(-1e304, 1e308), Error);
  const auto large = [](int x, int, int) { return x == 0 ? -3e38 : 3e38; };
  EXPECT_THROW(volumeOf(gridOf(dims), channelOf<float>(dims, large, 1e275)), Error);
}

TEST(Values, OfMinusZeroAreZero) {
  const Row row = Row::of<float>({-0.0, 0.0, -0.0, 1});
  for (const double x : {0.0, 0.5, 1.0, 1.5, 2.0}) {
    EXPECT_EQ(row.position(x, 0, 1), 0) << x;
    EXPECT_EQ(row.position(x, 0, 0), 1) << x;  // at the step, not below
    EXPECT_EQ(row.position(x, -1, 1), 0.5) << x;
  }
}

TEST(Values, AreNotFiniteExactlyWhereACornerOfTheCellIsNot) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    const Row row = Row::of<float>({1, 1, bad, 1, 1, 1, 1});
    const auto finite = [&](double x) { return std::isfinite(row.sample(x)); };
    EXPECT_TRUE(finite(-0.5));
    EXPECT_TRUE(finite(0.999));
    for (const double x : {1.0, 1.5, 2.0, 2.5, 2.999}) EXPECT_FALSE(finite(x)) << x;
    for (const double x : {3.0, 3.5, 6.0, 6.5}) EXPECT_TRUE(finite(x)) << x;
  }
  const Row opposite = Row::of<float>({kInfinity, -kInfinity});
  for (const double x : {0.0, 0.5, 1.0}) EXPECT_FALSE(std::isfinite(opposite.sample(x)));
}

TEST(Values, OfAConstantVolumeAreThatConstantToTheLastBit) {
  for (const float value : {0.1f, 1.0f / 3, 1e-30f, 7e30f, -280.1f}) {
    const Row row = Row::of<float>(std::vector<double>(5, double(value)));
    for (double x = -0.5; x <= 4.5; x += 0.0371) ASSERT_EQ(row.sample(x), double(value));
    EXPECT_EQ(row.position(1.7, double(value), double(value)), 1);
  }
}

}  // namespace
}  // namespace scolopax
