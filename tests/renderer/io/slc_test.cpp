// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string slcHeader(const std::string& size, int compression, int unit = 1) {
  return "11111\n" + size + " 8\n0.500000 1.000000 2.000000\n" + std::to_string(unit) + " 6 0 " +
         std::to_string(compression) + "\n2 1 X" + std::string(6, 'i');
}
std::string slcError(const TempDir& folder, const std::string& bytes) {
  return loadError(writeBytes(folder / "a.slc", bytes));
}

TEST(SlcFiles, NeghipIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("scalar/neghip.slc"));
  const LoadedFile file = loadFile(dataFile("scalar/neghip.slc"), kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(66));
  EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(1.0));
  EXPECT_EQ(file.worldUnit, "mm");
  EXPECT_EQ(file.channels.at(0).voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 255.0));
}

TEST(SlcFiles, NeghipAgreesWithItsCopyWithoutTheBorder) {
  const auto copy = dataFile("scalar/neghip_64x64x64_uint8.derived.raw");
  SKIP_WITHOUT(copy);
  const LoadedFile file = loadFile(dataFile("scalar/neghip.slc"), kTestLimit, {});
  std::ifstream stream(copy, std::ios::binary);
  const std::string expected{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_EQ(expected.size(), 64u * 64 * 64);
  const auto voxels = file.channels.at(0).voxels.as<std::uint8_t>();
  ASSERT_EQ(voxels.size(), 66u * 66 * 66);
  std::size_t different = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const std::size_t x = i % 66, y = i / 66 % 66, z = i / (66 * 66);
    const bool inside = x > 0 && x < 65 && y > 0 && y < 65 && z > 0 && z < 65;
    const int value = inside ? static_cast<unsigned char>(expected[((z - 1) * 64 + y - 1) * 64 + x - 1]) : 0;
    different += voxels[i] != value;
  }
  EXPECT_EQ(different, 0u);
}

TEST(SlcFiles, PlainAndPackedSlicesHoldTheSame) {
  const TempDir folder;
  const std::string plain = slcHeader("3 2 2", 0) + std::string("\0\0\0\1\2\3", 6) + "\4\4\4\4\5\6";
  // 3 times 0, then 1, 2, 3 as they are; 4 times 4, then 5, 6. A count of 0 may end a slice.
  const std::string packed =
      slcHeader("3 2 2", 1) + std::string("7 X\3\0\x83\1\2\3\0", 10) + "5 X\4\4\x82\5\6";
  for (const std::string& bytes : {plain, packed, gzipped(packed)}) {
    const LoadedFile file = loadFile(writeBytes(folder / "a.slc", bytes), kTestLimit, {});
    EXPECT_EQ(file.grid.dims, glm::ivec3(3, 2, 2));
    EXPECT_EQ(file.grid.spacing(), glm::dvec3(0.5, 1, 2));
    EXPECT_EQ(file.worldUnit, "mm");
    EXPECT_THAT(valuesOf(file.channels.at(0)), ElementsAre(0, 0, 0, 1, 2, 3, 4, 4, 4, 4, 5, 6));
  }
  EXPECT_EQ(loadFile(writeBytes(folder / "um.slc", slcHeader("1 1 1", 0, 2) + "x"), kTestLimit, {}).worldUnit,
            "um");
}

TEST(SlcFiles, BadHeadersNameTheFieldThatIsWrong) {
  const TempDir folder;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string bytes = slcHeader("3 2 2", 0) + std::string(12, 'v');
    bytes.replace(bytes.find(from), from.size(), to);
    return slcError(folder, bytes);
  };
  EXPECT_EQ(with("11111", "11111"), "");
  EXPECT_THAT(with("11111", "11112"), HasSubstr("a.slc: magic: expected 11111, found \"11112\""));
  EXPECT_THAT(with("3 2 2", "0 2 2"),
              HasSubstr("size: expected a whole number from 1 to 16777216, found \"0\""));
  EXPECT_THAT(with("3 2 2", "3 2 x"), HasSubstr("size: expected a whole number"));
  EXPECT_THAT(with("3 2 2", "3 3 2"),
              HasSubstr("size: 3x3x2 uint8 needs 18 bytes, the file holds at most 12"));
  EXPECT_THAT(with("3 2 2", "9999999 9999999 9999999"), HasSubstr("size: expected at most 2^48"));
  EXPECT_THAT(with(" 8\n", " 16\n"), HasSubstr("bits per voxel: expected 8, found \"16\""));
  EXPECT_THAT(with("0.500000", "0"), HasSubstr("spacing: expected a number above 0"));
  EXPECT_THAT(with("0.500000", "nan"), HasSubstr("spacing: expected a number above 0"));
  EXPECT_THAT(with("1 6 0 0", "5 6 0 0"), HasSubstr("unit: expected a whole number from 0 to 4"));
  EXPECT_THAT(with("1 6 0 0", "1 6 0 2"), HasSubstr("compression: expected a whole number from 0 to 1"));
  EXPECT_THAT(with("2 1 X", "2 1 Y"), HasSubstr("icon: expected the letter X behind it, found \"Y\""));
  EXPECT_THAT(with("2 1 X", "65536 65536 X"), HasSubstr("the file holds at most 0 bytes"));
  EXPECT_THAT(with("2 1 X", "2000000 1 X"), HasSubstr("icon: expected a whole number"));
  EXPECT_THAT(with("3 2 2", std::string(100, '1')), HasSubstr("size: expected a number"));
}

TEST(SlcFiles, BadRunsNameTheirSlice) {
  const TempDir folder;
  const auto second = [&](const std::string& slice) {
    return slcError(folder, slcHeader("3 2 2", 1) + "2 X\6z" + slice);
  };
  EXPECT_EQ(second("2 X\6z"), "");
  for (const std::string& slice :
       {std::string("2 X\7z"), std::string("2 X\5z"), std::string("0 X"), std::string("1 X\6"),
        std::string("3 X\x86zz"), std::string("4 X\6z\1z"), std::string("4 X\0z\6z", 8)})
    EXPECT_THAT(second(slice), HasSubstr("slice 1: expected runs of 6 voxels")) << slice;
  EXPECT_THAT(second("99 X\6z"), HasSubstr("slice 1: expected a whole number from 0 to 13"));
  EXPECT_THAT(second("-1 X\6z"), HasSubstr("slice 1: expected a whole number"));
  EXPECT_THAT(second("2 Y\6z"), HasSubstr("slice 1: expected the letter X"));
  EXPECT_THAT(slcError(folder, slcHeader("60000 60000 1", 1) + "2 X\6z"),
              HasSubstr("the file holds at most"));
}

TEST(SlcFiles, EveryTruncationIsAnError) {
  const TempDir folder;
  for (const std::string& whole :
       {slcHeader("3 2 2", 0) + std::string(12, 'v'), slcHeader("3 2 2", 1) + "2 X\6z2 X\6z"})
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(slcError(folder, whole.substr(0, length)), "") << length;
}

}  // namespace
}  // namespace scolopax::io
