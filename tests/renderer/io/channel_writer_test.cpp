// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "renderer/io/text.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::HasSubstr;

/// Values of type T converted by a ChannelWriter, with its messages.
template <class T>
std::pair<VoxelBuffer, std::string> converted(StoredType type, const std::vector<T>& values) {
  std::string said;
  Loading loading({.warn = [&](const std::string& text) { said += text; }}, 0);
  ChannelWriter writer("f", type, {int(values.size()), 1, 1}, loading);
  writer.write(0, std::as_bytes(std::span(values)));
  return {writer.take(), said};
}

TEST(ConvertVoxels, HalvesAreExactForEveryBitPattern) {
  for (unsigned bits = 0; bits < 65536; ++bits) {
    const int exponent = int(bits >> 10 & 31), mantissa = int(bits & 1023);
    const double sign = bits & 0x8000 ? -1 : 1;
    const float value = floatFromHalf(std::uint16_t(bits));
    EXPECT_EQ(std::signbit(value), (bits & 0x8000) != 0) << bits;
    if (exponent == 31) {
      EXPECT_EQ(std::isnan(value), mantissa != 0) << bits;
      EXPECT_EQ(std::isinf(value), mantissa == 0) << bits;
    } else {
      const double expected =
          exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
      EXPECT_EQ(double(value), sign * expected) << bits;
    }
  }
}

TEST(ConvertVoxels, WideIntegersTakeTheSmallestTypeThatHoldsThemAll) {
  const auto [shorts, shortText] = converted<std::int32_t>(StoredType::i32, {-32768, 0, 32767});
  EXPECT_EQ(shorts.type(), ScalarType::i16);
  EXPECT_EQ(shorts.as<std::int16_t>()[0], -32768);
  EXPECT_THAT(shortText, HasSubstr("f: int32 voxels are kept as int16 (every value fits)"));
  const auto [unsignedShorts, unsignedText] = converted<std::int32_t>(StoredType::i32, {0, 32768, 65535});
  EXPECT_EQ(unsignedShorts.type(), ScalarType::u16);
  EXPECT_EQ(unsignedShorts.as<std::uint16_t>()[2], 65535);
  const auto [floats, floatText] = converted<std::int32_t>(StoredType::i32, {-1, 65535});
  EXPECT_EQ(floats.type(), ScalarType::f32);
  EXPECT_EQ(floats.as<float>()[1], 65535.0f);
  EXPECT_THAT(floatText, HasSubstr("kept as float32 (no rounding)"));
  const auto [large, largeText] = converted<std::uint32_t>(StoredType::u32, {0, (1u << 24) + 1});
  EXPECT_EQ(large.as<float>()[1], 16777216.0f);
  EXPECT_THAT(largeText,
              HasSubstr("uint32 voxels are kept as float32 (largest relative rounding error 6e-08)"));
}

TEST(ConvertVoxels, SixtyFourBitsSayWhatRoundingCost) {
  const auto [exact, exactText] = converted<double>(StoredType::f64, {0.5, NAN, INFINITY, -0.0});
  EXPECT_TRUE(std::isnan(exact.as<float>()[1]));
  EXPECT_TRUE(std::isinf(exact.as<float>()[2]));
  EXPECT_TRUE(std::signbit(exact.as<float>()[3]));
  EXPECT_THAT(exactText, HasSubstr("(no rounding)"));
  const auto [beyond, beyondText] = converted<double>(StoredType::f64, {1e300, -1e39, 1});
  EXPECT_TRUE(std::isinf(beyond.as<float>()[0]));
  EXPECT_THAT(beyondText, HasSubstr("2 values beyond the range of float32 became infinite"));
  const auto [lost, lostText] = converted<double>(StoredType::f64, {1e-300});
  EXPECT_EQ(lost.as<float>()[0], 0.0f);
  EXPECT_THAT(lostText, HasSubstr("largest relative rounding error 1)"));
  const auto [integers, integerText] =
      converted<std::int64_t>(StoredType::i64, {(std::int64_t(1) << 53) + 1});
  EXPECT_THAT(integerText,
              HasSubstr("int64 voxels are kept as float32 (largest relative rounding error 1.1e-16)"));
}

TEST(ConvertVoxels, SizesSaturateInsteadOfWrapping) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(saturatingProduct(most / 2, 3), most);
  EXPECT_EQ(saturatingProduct(most, 0), 0u);
  EXPECT_EQ(saturatingSum(most, 1), most);
  EXPECT_EQ(saturatingSum(most - 1, 1), most);
}

TEST(TextOfFiles, IsOneCleanLineOfUtf8) {
  EXPECT_EQ(cleanText("a\nb\x01\x7F c"), "ab c");
  EXPECT_EQ(cleanText("\xCF\x88 \xE2\x82\xAC \xF0\x9F\x98\x80"), "\xCF\x88 \xE2\x82\xAC \xF0\x9F\x98\x80");
  EXPECT_EQ(cleanText("\xC0\x80"), "??") << "overlong";
  EXPECT_EQ(cleanText("\xED\xA0\x80"), "???") << "a surrogate";
  EXPECT_EQ(cleanText("\xF4\x90\x80\x80"), "????") << "beyond U+10FFFF";
  EXPECT_EQ(cleanText("x\xE2\x82"), "x??") << "cut off";
  EXPECT_EQ(inQuotes(std::string(100, 'x')), "\"" + std::string(80, 'x') + "...\"");
}

TEST(TextOfFiles, NumbersAreWholeOrNothing) {
  EXPECT_EQ(parseInteger("42"), 42);
  EXPECT_EQ(parseInteger("+42"), 42);
  EXPECT_EQ(parseInteger("-42"), -42);
  for (const char* bad : {"", "+", "+-1", "4 2", "4.0", "0x4", "9223372036854775808"})
    EXPECT_FALSE(parseInteger(bad)) << bad;
  EXPECT_EQ(parseNumber("-1.5e3"), -1500);
  EXPECT_TRUE(std::isnan(parseNumber("NaN").value()));
  for (const char* bad : {"", "1,5", "1.5 ", "1e999", "one"}) EXPECT_FALSE(parseNumber(bad)) << bad;
}

TEST(TextOfFiles, StemsLoseTheEndingAndItsPacking) {
  EXPECT_EQ(stemOf("/data/T1.nii.gz"), "T1");
  EXPECT_EQ(stemOf("a.b.nrrd"), "a.b");
  EXPECT_EQ(stemOf("a_2x2x2_uint8.raw.GZ"), "a_2x2x2_uint8");
}

}  // namespace
}  // namespace scolopax::io
