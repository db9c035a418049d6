// SPDX-License-Identifier: Apache-2.0
// Zarr in ZIP archives, made by libzip.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

#if __has_include(<zip.h>)
#include <zip.h>

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path writeZip(const std::filesystem::path& path, const ZarrValues& values, int method,
                               const std::string& root = "") {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  EXPECT_NE(archive, nullptr);
  for (const auto& [key, bytes] : values) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    const auto index = zip_file_add(archive, (root + key).c_str(), source, ZIP_FL_ENC_UTF_8);
    EXPECT_EQ(zip_set_file_compression(archive, zip_uint64_t(index), method, 0), 0);
  }
  EXPECT_EQ(zip_close(archive), 0);
  return path;
}

/// An image of two levels without compression, whose finest level counts up.
ZarrValues zippedImage() {
  const ZarrShape shape{3, 4, 5}, chunk{2, 4, 3};
  ZarrValues values{{".zgroup", kGroup2},
                    {".zattrs", multiscales("zyx", {{1, 1, 1}, {2, 2, 2}}).dump()},
                    {"0/.zarray", array2(shape, chunk, "<u2").dump()},
                    {"1/.zarray", array2({1, 2, 2}, {1, 2, 2}, "<u2").dump()}};
  addChunks(values, shape, chunk, "0/", '.',
            [&](const ZarrShape& first) { return rampChunk<std::uint16_t>(shape, chunk, first); });
  return values;
}

TEST(ZarrZip, StoredAndDeflatedEntriesLoad) {
  const TempDir folder;
  for (const int method : {ZIP_CM_STORE, ZIP_CM_DEFLATE})
    for (const char* name : {"a.zarr.zip", "a.ozx", "a.ome.zarr.zip"}) {
      const auto path = writeZip(folder / name, zippedImage(), method);
      const auto file = openFile(path);
      ASSERT_EQ(file->volumes.size(), 1u);
      EXPECT_EQ(file->volumes[0].levels.size(), 2u);
      EXPECT_EQ(file->volumes[0].channels[0].name, "a");
      EXPECT_EQ(zarrValues(path), rampUpTo(60)) << name << method;
    }
}

TEST(ZarrZip, AFolderAroundEverythingIsPassed) {
  const TempDir folder;
  EXPECT_EQ(zarrValues(writeZip(folder / "a.zarr.zip", zippedImage(), ZIP_CM_DEFLATE, "a.zarr/")),
            rampUpTo(60));
}

TEST(ZarrZip, GroupsAreListed) {
  const TempDir folder;
  const std::string array = array2({1, 1, 2}, {1, 1, 2}, "|u1").dump();
  const auto file = openFile(
      writeZip(folder / "a.zarr.zip",
               {{".zgroup", kGroup2}, {"b/.zarray", array}, {"g/.zgroup", kGroup2}, {"g/a/.zarray", array}},
               ZIP_CM_STORE));
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].path, "b");
  EXPECT_EQ(file->volumes[1].path, "g/a");
}

TEST(ZarrZip, ShardsAreReadInPlace) {
  const auto from = dataFile("formats/ome_zarr_v3/sharding_index_location/start");
  SKIP_WITHOUT(from);
  const TempDir folder;
  ZarrValues values;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(from)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    values[entry.path().lexically_relative(from).string()] = {std::istreambuf_iterator<char>(file), {}};
  }
  for (const int method : {ZIP_CM_STORE, ZIP_CM_DEFLATE})
    EXPECT_EQ(zarrValues(writeZip(folder / "a.zarr.zip", values, method)), rampUpTo(4096)) << method;
}

TEST(ZarrZip, EveryTruncationAndDamageIsHarmless) {
  const TempDir folder;
  const auto path = writeZip(folder / "a.zarr.zip", zippedImage(), ZIP_CM_DEFLATE);
  std::ifstream file(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(file), {}};
  for (std::size_t length = 0; length < whole.size(); length += 3)
    EXPECT_NE(loadError(writeBytes(folder / "b.zarr.zip", whole.substr(0, length))), "") << length;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = char(damaged[at] ^ 0x5A);
    loadError(writeBytes(folder / "b.zarr.zip", damaged));
  }
  const std::size_t bytes = whole.find(".zattrs") + 7;
  std::string damaged = whole;
  damaged[bytes + 40] = char(damaged[bytes + 40] ^ 0x5A);
  EXPECT_THAT(loadError(writeBytes(folder / "c.zarr.zip", damaged)),
              HasSubstr("c.zarr.zip/.zattrs: the ZIP entry is damaged"));
}

TEST(ZarrZip, OtherArchivesAreRefused) {
  const TempDir folder;
  EXPECT_THAT(loadError(writeZip(folder / "a.zarr.zip", {{"b.txt", "text"}}, ZIP_CM_STORE)),
              HasSubstr("a.zarr.zip: expected a volume, found none"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.zarr.zip", "text")),
              HasSubstr("b.zarr.zip: expected a ZIP archive"));
}

}  // namespace
}  // namespace scolopax::io
#endif
