// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The bytes of a .npy file as numpy.save writes them: the data begin at a multiple of 64.
std::string npyBytes(const std::string& dictionary, const std::string& data, int version = 1) {
  std::string header = dictionary;
  const std::size_t before = version == 1 ? 10 : 12;
  header += std::string(63 - (before + header.size()) % 64, ' ') + "\n";
  std::string bytes = "\x93NUMPY" + std::string{char(version), '\0'};
  for (std::size_t i = 0; i < before - 8; ++i) bytes += char(header.size() >> (8 * i) & 0xFF);
  return bytes + header + data;
}
std::string npyDictionary(const std::string& descr, const std::string& shape, bool fortran = false) {
  return "{'descr': '" + descr + "', 'fortran_order': " + (fortran ? "True" : "False") +
         ", 'shape': " + shape + ", }";
}
std::string npyRamp(int count) {
  std::vector<std::int16_t> values;
  for (int i = 0; i < count; ++i) values.push_back(std::int16_t(i));
  return bytesOf(values);
}
LoadedFile loadNpy(const TempDir& folder, const std::string& bytes, std::size_t time = 0,
                   FourthAxis fourthAxis = FourthAxis::automatic) {
  return loadFile(writeBytes(folder / "a.npy", bytes), kTestLimit, {}, time, fourthAxis);
}
std::string npyError(const TempDir& folder, const std::string& dictionary,
                     const std::string& data = npyRamp(12)) {
  return errorOf([&] { loadNpy(folder, npyBytes(dictionary, data)); });
}

TEST(NpyFiles, EveryTypeAndByteOrderLoads) {
  const TempDir folder;
  const auto check = [&]<class T>(const std::string& code, T) {
    SCOPED_TRACE(code);
    const std::vector<T> stored{T(1), T(100), T(7), T(0)};
    for (const bool big : {false, true}) {
      const std::string order = sizeof(T) == 1 ? "|" : big ? ">" : "<";
      const auto file =
          loadNpy(folder, npyBytes(npyDictionary(order + code, "(1, 2, 2)"), bytesOf(stored, big)));
      EXPECT_EQ(file.grid.dims, glm::ivec3(2, 2, 1));
      EXPECT_THAT(valuesOf(file.channels.at(0)), ElementsAre(1, 100, 7, 0));
      EXPECT_EQ(file.channels[0].name, "a");
    }
  };
  check("i1", std::int8_t());
  check("u1", std::uint8_t());
  check("i2", std::int16_t());
  check("u2", std::uint16_t());
  check("i4", std::int32_t());
  check("u4", std::uint32_t());
  check("i8", std::int64_t());
  check("u8", std::uint64_t());
  check("f4", float());
  check("f8", double());
  // 0.5, -2 and the largest float16
  const std::vector<std::uint16_t> halves{0x3800, 0xC000, 0x7BFF};
  for (const bool big : {false, true}) {
    const auto file =
        loadNpy(folder, npyBytes(npyDictionary(big ? ">f2" : "<f2", "(3,)"), bytesOf(halves, big)));
    EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(0.5, -2, 65504));
  }
  const auto flags = loadNpy(folder, npyBytes(npyDictionary("|b1", "(2, 1, 1)"), std::string("\1\0", 2)));
  EXPECT_EQ(flags.grid.dims, glm::ivec3(1, 1, 2));
  EXPECT_THAT(valuesOf(flags.channels[0]), ElementsAre(1, 0));
}

TEST(NpyFiles, AxesAreZyxInEitherOrderOfMemory) {
  const TempDir folder;
  // numpy.arange(24).reshape(2, 3, 4)[z, y, x] is 12 z + 4 y + x
  const auto rows = loadNpy(folder, npyBytes(npyDictionary("<i2", "(2, 3, 4)"), npyRamp(24)));
  std::vector<std::int16_t> columns;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 2; ++z) columns.push_back(std::int16_t(12 * z + 4 * y + x));
  const auto fortran = loadNpy(folder, npyBytes(npyDictionary("<i2", "(2, 3, 4)", true), bytesOf(columns)));
  for (const LoadedFile* file : {&rows, &fortran}) {
    EXPECT_EQ(file->grid.dims, glm::ivec3(4, 3, 2));
    const auto values = valuesOf(file->channels[0]);
    for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(values[i], double(i));
  }
  EXPECT_EQ(loadNpy(folder, npyBytes(npyDictionary("<i2", "(3, 4)"), npyRamp(12))).grid.dims,
            glm::ivec3(4, 3, 1));
  EXPECT_EQ(loadNpy(folder, npyBytes(npyDictionary("<i2", "(12,)"), npyRamp(12))).grid.dims,
            glm::ivec3(12, 1, 1));
}

TEST(NpyFiles, AFourthAxisIsTimesOrChannelsInEitherOrderOfMemory) {
  const TempDir folder;
  // The element at (a, b, c, d) has the value 1000 a + 100 b + 10 c + d.
  const auto load = [&](const std::array<int, 4>& shape, bool fortran, std::size_t time,
                        FourthAxis fourthAxis) {
    std::vector<std::int16_t> values;
    std::array<int, 4> at{};
    const int count = shape[0] * shape[1] * shape[2] * shape[3];
    for (int i = 0; i < count; ++i) {
      values.push_back(std::int16_t(1000 * at[0] + 100 * at[1] + 10 * at[2] + at[3]));
      for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t axis = fortran ? k : 3 - k;
        if (++at[axis] < shape[axis]) break;
        at[axis] = 0;
      }
    }
    std::string text = "(";
    for (const int size : shape) text += std::to_string(size) + ", ";
    return loadNpy(folder, npyBytes(npyDictionary("<i2", text + ")", fortran), bytesOf(values)), time,
                   fourthAxis);
  };
  for (const bool fortran : {false, true}) {
    SCOPED_TRACE(fortran);
    const auto times = load({4, 1, 2, 2}, fortran, 3, FourthAxis::automatic);
    EXPECT_EQ(times.times.count, 4u);
    ASSERT_EQ(times.channels.size(), 1u);
    EXPECT_THAT(valuesOf(times.channels[0]), ElementsAre(3000, 3001, 3010, 3011));
    const auto leading = load({3, 2, 1, 3}, fortran, 0, FourthAxis::automatic);
    ASSERT_EQ(leading.channels.size(), 3u) << "the first axis, though both have a length of 3";
    EXPECT_THAT(valuesOf(leading.channels[2]), ElementsAre(2000, 2001, 2002, 2100, 2101, 2102));
    const auto vectors = load({1, 2, 2, 3}, fortran, 0, FourthAxis::automatic);
    EXPECT_EQ(vectors.grid.dims, glm::ivec3(2, 2, 1));
    ASSERT_EQ(vectors.channels.size(), 3u);
    EXPECT_EQ(vectors.channels[1].name, "a 1");
    EXPECT_THAT(valuesOf(vectors.channels[1]), ElementsAre(1, 11, 101, 111));
    const auto asTimes = load({1, 2, 2, 3}, fortran, 2, FourthAxis::time);
    EXPECT_EQ(asTimes.times.count, 3u);
    EXPECT_THAT(valuesOf(asTimes.channels.at(0)), ElementsAre(2, 12, 102, 112));
    const auto asChannels = load({4, 1, 2, 2}, fortran, 0, FourthAxis::channel);
    ASSERT_EQ(asChannels.channels.size(), 4u);
    EXPECT_THAT(valuesOf(asChannels.channels[1]), ElementsAre(1000, 1001, 1010, 1011));
  }
}

TEST(NpyFiles, SomeChannelsAreReadWithoutTheOthers) {
  const TempDir folder;
  const auto path = writeBytes(folder / "a.npy", npyBytes(npyDictionary("<i2", "(4, 1, 1, 3)"), npyRamp(12)));
  const auto file = openFile(path, {.fourthAxis = FourthAxis::channel});
  ASSERT_EQ(file->volumes[0].channels.size(), 3u);
  const LoadedPart part = load(*file, Part{.channels = {2, 0}}, LoadOptions{.memoryLimitBytes = kTestLimit});
  ASSERT_EQ(part.channels.size(), 2u);
  EXPECT_THAT(valuesOf(part.channels[0]), ElementsAre(0, 3, 6, 9));
  EXPECT_THAT(valuesOf(part.channels[1]), ElementsAre(2, 5, 8, 11));
}

TEST(NpyFiles, HeadersOfEveryVersionAndSpellingLoad) {
  const TempDir folder;
  const std::string data = npyRamp(12);
  for (const int version : {1, 2, 3}) {
    const auto file = loadNpy(folder, npyBytes(npyDictionary("<i2", "(1, 3, 4)"), data, version));
    EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 11.0)) << version;
  }
  for (const char* dictionary : {"{\"shape\":(1,3,4),\"fortran_order\":False,\"descr\":\"<i2\"}",
                                 "{'shape': (1L, 3L, 4L), 'descr': '<i2', 'fortran_order': False, }",
                                 "  { 'shape' : ( 3 , 4 , ) , 'descr' : '<i2' , 'fortran_order' : False } "})
    EXPECT_EQ(npyError(folder, dictionary), "") << dictionary;
  const auto packed = writeBytes(folder / "a.npy.gz", gzipped(npyBytes(npyDictionary("<i2", "(12,)"), data)));
  EXPECT_EQ(rangeOf(loadFile(packed, kTestLimit, {}).channels[0]), std::pair(0.0, 11.0));
}

TEST(NpyFiles, BadHeadersNameWhatIsWrong) {
  const TempDir folder;
  const auto descr = [&](const std::string& text) { return npyError(folder, npyDictionary(text, "(2,)")); };
  EXPECT_THAT(descr("|O"), HasSubstr("a.npy: descr: expected numbers, not pickled Python objects"));
  for (const char* text : {"<c8", "<U3", "|S5", "<M8[ns]", "<f16", "|V4", "|i2", "f4", "", "<", "i2"})
    EXPECT_THAT(descr(text), HasSubstr("descr: expected a type of real numbers")) << text;
  EXPECT_THAT(
      npyError(folder, "{'descr': [('r', '|u1'), ('g', '|u1')], 'fortran_order': False, 'shape': (2,)}"),
      HasSubstr("descr: expected one number per element"));
  const auto shape = [&](const std::string& text) { return npyError(folder, npyDictionary("<i2", text)); };
  EXPECT_THAT(shape("()"), HasSubstr("shape: expected 1 to 4 axes, found 0"));
  EXPECT_THAT(shape("(1, 1, 1, 1, 1)"), HasSubstr("shape: expected 1 to 4 axes, found 5"));
  EXPECT_THAT(shape("(12)"), HasSubstr("header: expected a comma in a tuple of one"));
  EXPECT_THAT(shape("(-2, 3)"), HasSubstr("header: expected whole numbers in shape"));
  EXPECT_THAT(shape("(2.5, 3)"), HasSubstr("header: expected \")\""));
  EXPECT_THAT(shape("[2, 3]"), HasSubstr("header: expected \"(\""));
  EXPECT_THAT(shape("(99999999999999999999,)"), HasSubstr("header: expected whole numbers in shape"));
  EXPECT_THAT(shape("(0, 3, 4)"), HasSubstr("shape: expected sizes of at least 1"));
  EXPECT_THAT(shape("(0, 3, 4, 4)"),
              HasSubstr("shape: expected 1 to 16777216 along the fourth axis, found 0"));
  EXPECT_THAT(shape("(5000, 3, 4, 3)"), HasSubstr("the file holds"));
  EXPECT_THAT(shape("(13,)"), HasSubstr("needs"));
  EXPECT_THAT(shape("(60000, 60000, 60000)"), HasSubstr("the file holds"));
  EXPECT_THAT(shape("(1, 1, 16777217)"), HasSubstr("shape: expected at most 2^48 voxels"));
  for (const char* text :
       {"", "{", "[]", "{}", "{'descr': '<i2'}", "{'descr' '<i2'}", "{'descr': <i2, 'shape': (2,)}",
        "{'descr': '<i2', 'fortran_order': 0, 'shape': (2,)}",
        "{'descr': '<i2', 'fortran_order': Trueish, 'shape': (2,)}",
        "{'descr': '<i2', 'descr': '<i2', 'fortran_order': True, 'shape': (2,)}",
        "{'descr': '<i2', 'fortran_order': True, 'shape': (2,), 'more': 1}",
        "{'descr': '<\\x69 2', 'fortran_order': True, 'shape': (2,)}",
        "{'descr': '<i2', 'fortran_order': True, 'shape': (2,)} + 1",
        "{'descr': '<i2', 'fortran_order': True, 'shape': (2,)", "{,}", "{'descr': '<i2"})
    EXPECT_THAT(npyError(folder, text), HasSubstr("a.npy: header: expected")) << text;
  const auto magic = [&](const std::string& bytes) {
    return loadError(writeBytes(folder / "b.npy", bytes + std::string(64, '\0')));
  };
  EXPECT_THAT(magic("\x93NUMPX"), HasSubstr("magic: expected"));
  EXPECT_THAT(magic(std::string("\x93NUMPY\4\0", 8)),
              HasSubstr("version: expected 1.0, 2.0 or 3.0, found \"4.0\""));
  EXPECT_THAT(magic("\x93NUMPY\2" + std::string("\0\xFF\xFF\xFF\xFF", 5)),
              HasSubstr("header length: expected at most 1 MiB, found \"4294967295\""));
}

TEST(NpyFiles, EveryTruncationIsAnError) {
  const TempDir folder;
  for (const bool fortran : {false, true}) {
    const std::string whole = npyBytes(npyDictionary("<i2", "(2, 3, 2)", fortran), npyRamp(12));
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(loadError(writeBytes(folder / "a.npy", whole.substr(0, length))), "") << length;
  }
}

}  // namespace
}  // namespace scolopax::io
