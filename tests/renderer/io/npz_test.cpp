// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

#define SKIP_WITHOUT_ZIP()               \
  for (const Format& format : formats()) \
    if (format.endings == ".npz" && !format.missing.empty()) GTEST_SKIP() << "built without libzip"

std::string zipNumber(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i, value >>= 8) text += char(value & 0xFF);
  return text;
}

struct ZipEntry {
  std::string name, bytes;
  std::uint32_t statedSize = 0;  ///< 0: the true one
  int method = 0;                ///< 0: by `packed`
};
/// A zip archive by its specification (PKWARE's APPNOTE).
std::string zipped(const std::vector<ZipEntry>& entries, bool packed) {
  std::string archive, directory;
  for (const ZipEntry& entry : entries) {
    const std::string data = packed ? deflated(entry.bytes, -15) : entry.bytes;
    const auto crc = ::crc32(0, reinterpret_cast<const Bytef*>(entry.bytes.data()), uInt(entry.bytes.size()));
    const std::string common = zipNumber(20, 2) + zipNumber(0, 2) +
                               zipNumber(entry.method ? unsigned(entry.method)
                                         : packed     ? 8
                                                      : 0,
                                         2) +
                               zipNumber(0, 4) + zipNumber(crc, 4) + zipNumber(data.size(), 4) +
                               zipNumber(entry.statedSize ? entry.statedSize : entry.bytes.size(), 4) +
                               zipNumber(entry.name.size(), 2) + zipNumber(0, 2);
    directory +=
        "PK\1\2" + zipNumber(20, 2) + common + zipNumber(0, 10) + zipNumber(archive.size(), 4) + entry.name;
    archive += "PK\3\4" + common + entry.name + data;
  }
  return archive + directory + "PK\5\6" + zipNumber(0, 4) + zipNumber(entries.size(), 2) +
         zipNumber(entries.size(), 2) + zipNumber(directory.size(), 4) + zipNumber(archive.size(), 4) +
         zipNumber(0, 2);
}

std::string npzArray(const std::string& descr, const std::string& shape, const std::string& data) {
  const std::string header = "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }\n";
  return std::string("\x93NUMPY\1\0", 8) + zipNumber(header.size(), 2) + header + data;
}
const std::string kOnes = npzArray("|u1", "(1, 2, 2)", "\1\1\1\1");
const std::string kRising = npzArray("<i2", "(2, 1, 2)", std::string("\1\0\2\0\3\0\4\0", 8));

TEST(NpzFiles, EachArrayIsAVolume) {
  SKIP_WITHOUT_ZIP();
  const TempDir folder;
  for (const bool packed : {false, true}) {
    std::vector<std::string> warnings;
    const auto path = writeBytes(folder / "two.npz", zipped({{"ones.npy", kOnes},
                                                             {"spacing.npy", npzArray("|u1", "(3,)", "abc")},
                                                             {"group/rising.npy", kRising},
                                                             {"objects.npy", npzArray("|O", "(1, 1)", "?")},
                                                             {"none.npy", npzArray("|u1", "(0, 5)", "")},
                                                             {"notes.txt", "text"}},
                                                            packed));
    const auto file = openFile(path, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
    EXPECT_THAT(
        warnings,
        ElementsAre(HasSubstr("two.npz:spacing: shape: expected 2 to 4 axes, found 1; it is left out"),
                    HasSubstr("two.npz:objects: descr: expected numbers, not pickled Python objects"),
                    HasSubstr("two.npz:none: shape: expected elements"),
                    HasSubstr("\"notes.txt\" is no array and is left out")));
    ASSERT_EQ(file->volumes.size(), 2u);
    EXPECT_EQ(file->volumes[0].path, "ones");
    EXPECT_EQ(file->volumes[1].path, "group/rising");
    EXPECT_EQ(file->volumes[1].channels[0].name, "group/rising");
    const LoadedPart part = load(*file, Part{.volume = 1}, LoadOptions{.memoryLimitBytes = kTestLimit});
    EXPECT_EQ(part.grid.dims, glm::ivec3(2, 1, 2));
    EXPECT_EQ(part.channels[0].voxels.type(), ScalarType::i16);
    EXPECT_THAT(valuesOf(part.channels[0]), ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(valuesOf(load(*file, Part{}, LoadOptions{.memoryLimitBytes = kTestLimit}).channels[0]),
                ElementsAre(1, 1, 1, 1));
  }
}

TEST(NpzFiles, OneOfSeveralTimesIsRead) {
  SKIP_WITHOUT_ZIP();
  const TempDir folder;
  const std::string data("\0\1\2\3\4\5\6\7", 8);
  const auto path =
      writeBytes(folder / "a.npz", zipped({{"a.npy", npzArray("|u1", "(4, 1, 1, 2)", data)}}, true));
  EXPECT_THAT(valuesOf(loadFile(path, kTestLimit, {}, 2).channels.at(0)), ElementsAre(4, 5));
}

TEST(NpzFiles, AreFoundByTheirFirstEntryWithoutTheirName) {
  SKIP_WITHOUT_ZIP();
  const TempDir folder;
  EXPECT_EQ(openFile(writeBytes(folder / "a", zipped({{"b.npy", kOnes}}, false)))->volumes.size(), 1u);
  EXPECT_THAT(loadError(writeBytes(folder / "b", zipped({{"b.txt", kOnes}}, false))),
              HasSubstr("expected one of"));
}

TEST(NpzFiles, ArchivesThatLieAreRefused) {
  SKIP_WITHOUT_ZIP();
  const TempDir folder;
  const auto error = [&](const std::string& bytes) { return loadError(writeBytes(folder / "a.npz", bytes)); };
  EXPECT_THAT(error("no archive"), HasSubstr("a.npz: expected a zip archive, found: "));
  EXPECT_THAT(error(zipped({}, false)), HasSubstr("a.npz: expected a volume, found none"));
  EXPECT_THAT(error(zipped({{"a.npy", npzArray("|O", "(1, 1)", "?")}}, false)), HasSubstr("a.npz:a: descr"));
  EXPECT_THAT(error(zipped({{"a.npy", "PNG"}}, false)), HasSubstr("a.npz:a: expected more data"));
  const std::string large = npzArray("|u1", "(60000, 60000, 60000)", "");
  EXPECT_THAT(error(zipped({{"a.npy", large}}, false)), HasSubstr("a.npz:a: 60000x60000x60000 uint8 needs"));
  EXPECT_THAT(error(zipped({{"a.npy", npzArray("|u1", "(3000, 1000, 1000)", ""), 0xF0000000u}}, true)),
              HasSubstr("the archive holds at most"))
      << "deflate cannot expand so far";
  EXPECT_NE(error(zipped({{"a.npy", kOnes, 0, 99}}, false)), "") << "an unknown method";
  std::string damaged = zipped({{"a.npy", kOnes}}, false);
  damaged[damaged.find("\1\1\1\1")] = 2;
  EXPECT_THAT(error(damaged), HasSubstr("a.npz:a: expected sound data, found: CRC error"));
  std::vector<ZipEntry> many(4097, ZipEntry{"a.npy", kOnes});
  for (std::size_t i = 0; i < many.size(); ++i) many[i].name = std::to_string(i) + ".npy";
  EXPECT_THAT(error(zipped(many, false)), HasSubstr("at most 4096 arrays, found 4097"));
}

TEST(NpzFiles, EveryTruncationIsAnError) {
  SKIP_WITHOUT_ZIP();
  const TempDir folder;
  const std::string whole = zipped({{"a.npy", kOnes}, {"b.npy", kRising}}, true);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(loadError(writeBytes(folder / "a.npz", whole.substr(0, length))), "") << length;
}

}  // namespace
}  // namespace scolopax::io
