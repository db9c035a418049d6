// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <thread>

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

TEST(ChannelWriter, TakesBoxesInAnyOrderOfAxesAndLeavesOutWhatIsBesideTheVolume) {
  const glm::ivec3 dims(5, 4, 3), chunk(2, 3, 2);
  for (const int flip : {1, -1}) {
    Loading loading({}, 0);
    ChannelWriter writer("f", StoredType::i16, dims, loading);
    for (int z = -1; z < dims.z; z += chunk.z)
      for (int y = 0; y < dims.y; y += chunk.y)
        for (int x = 0; x < dims.x; x += chunk.x) {
          // z fastest, then x, then y, big-endian; with flip -1 from the last voxel to the first.
          std::vector<std::int16_t> stored(12);
          for (int k = 0; k < 2; ++k)
            for (int j = 0; j < 3; ++j)
              for (int i = 0; i < 2; ++i) {
                const int at = k + 2 * i + 4 * j;
                stored[std::size_t(flip > 0 ? at : 11 - at)] =
                    std::int16_t(__builtin_bswap16(std::uint16_t((x + i) + 10 * (y + j) + 100 * (z + k))));
              }
          const auto* bytes = reinterpret_cast<const std::byte*>(stored.data());
          writer.writeBox({x, y, z}, chunk, flip > 0 ? bytes : bytes + 22, {flip * 4, flip * 8, flip * 2},
                          true);
        }
    const VoxelBuffer voxels = writer.take();
    std::size_t at = 0;
    for (int z = 0; z < dims.z; ++z)
      for (int y = 0; y < dims.y; ++y)
        for (int x = 0; x < dims.x; ++x) ASSERT_EQ(voxels.as<std::int16_t>()[at++], x + 10 * y + 100 * z);
  }
}

TEST(ChannelWriter, MayBeWrittenBySeveralThreadsWhileTheTypeChanges) {
  constexpr int kThreads = 4, kRows = 64, kWidth = 1000;
  Loading loading({}, 0);
  ChannelWriter writer("f", StoredType::i32, {kWidth, kThreads * kRows, 1}, loading);
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int r = 0; r < kRows; ++r) {
        const int row = r * kThreads + t;
        // Rows up to 31 fit i16, up to 63 u16.
        std::vector<std::int32_t> values(kWidth);
        for (int i = 0; i < kWidth; ++i) values[std::size_t(i)] = row * 1000 + i;
        writer.write(std::size_t(row) * kWidth, std::as_bytes(std::span(values)));
      }
    });
  for (std::thread& thread : threads) thread.join();
  const VoxelBuffer voxels = writer.take();
  ASSERT_EQ(voxels.type(), ScalarType::f32);
  for (std::size_t i = 0; i < voxels.count(); ++i) ASSERT_EQ(voxels.as<float>()[i], float(i));
}

TEST(ChannelWriter, DemandsAllVoxelsUnlessTheyWereFilled) {
  Loading loading({}, 0);
  const std::vector<std::int32_t> two{7, 8};
  ChannelWriter partial("f", StoredType::i32, {3, 1, 1}, loading);
  partial.write(1, std::as_bytes(std::span(two)));
  EXPECT_THAT(errorOf([&] { partial.take(); }), HasSubstr("f: expected 3 voxels, found 2"));
  EXPECT_THAT(errorOf([&] { partial.write(2, std::as_bytes(std::span(two))); }), HasSubstr("found 2 + 2"));
  ChannelWriter filled("f", StoredType::i32, {3, 1, 1}, loading);
  filled.fill(-40000);
  filled.write(1, std::as_bytes(std::span(two)));
  const VoxelBuffer voxels = filled.take();
  ASSERT_EQ(voxels.type(), ScalarType::f32);
  EXPECT_THAT(voxels.as<float>(), testing::ElementsAre(-40000, 7, 8));
}

TEST(ChannelWriter, LimitsAFillValueToTheType) {
  Loading loading({}, 0);
  const auto filled = [&](StoredType type, double value) {
    ChannelWriter writer("f", type, {1, 1, 1}, loading);
    writer.fill(value);
    const VoxelBuffer voxels = writer.take();
    return visitScalarType(voxels.type(), [&](auto zero) { return double(voxels.as<decltype(zero)>()[0]); });
  };
  EXPECT_EQ(filled(StoredType::u8, 300), 255);
  EXPECT_EQ(filled(StoredType::u8, NAN), 0);
  EXPECT_EQ(filled(StoredType::i16, -1e300), -32768);
  EXPECT_EQ(filled(StoredType::u32, 1e300), 4294967296.0);
  EXPECT_TRUE(std::isnan(filled(StoredType::f32, NAN)));
  EXPECT_EQ(filled(StoredType::f16, 0.5), 0.5);
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
  EXPECT_EQ(stemOf("a.b.ome.tif"), "a.b");
  EXPECT_EQ(stemOf("a_2x2x2_uint8.raw.GZ"), "a_2x2x2_uint8");
}

}  // namespace
}  // namespace scolopax::io
