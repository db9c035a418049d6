// SPDX-License-Identifier: Apache-2.0
// Compressed chunks of Zarr, packed by the libraries themselves, and damage to all that is read.
#include <gmock/gmock.h>

#include <sys/stat.h>

#include "tests/renderer/io/zarr_test_support.h"

#if __has_include(<blosc.h>) && __has_include(<zstd.h>) && __has_include(<lz4.h>)
#include <blosc.h>
#include <lz4.h>
#include <zstd.h>

namespace scolopax::io {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const ZarrShape kCube{4, 8, 16};

std::string cubeBytes() { return rampChunk<std::uint16_t>(kCube, kCube, {0, 0, 0}); }

std::string zlibbed(const std::string& bytes) {
  uLongf size = compressBound(uLong(bytes.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           uLong(bytes.size()));
  packed.resize(size);
  return packed;
}

std::string zstdPacked(const std::string& bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 3));
  return packed;
}

std::string bloscPacked(const std::string& bytes, const char* compressor, int shuffle) {
  std::string packed(bytes.size() + BLOSC_MAX_OVERHEAD, '\0');
  const int size = blosc_compress_ctx(5, shuffle, 2, bytes.size(), bytes.data(), packed.data(), packed.size(),
                                      compressor, 0, 1);
  packed.resize(std::size_t(std::max(size, 0)));
  return packed;
}

std::string lz4Packed(const std::string& bytes) {
  std::string packed(std::size_t(LZ4_compressBound(int(bytes.size()))), '\0');
  packed.resize(
      std::size_t(LZ4_compress_default(bytes.data(), packed.data(), int(bytes.size()), int(packed.size()))));
  return bytesOf<std::uint32_t>({std::uint32_t(bytes.size())}) + packed;
}

std::filesystem::path writePacked(const TempDir& folder, const json& compressor, const std::string& packed) {
  json document = array2(kCube, kCube, "<u2");
  document["compressor"] = compressor;
  return writeZarr(folder / "a.zarr", {{".zarray", document.dump()}, {"0.0.0", packed}});
}

TEST(ZarrCodecs, EveryCompressorLoads) {
  const TempDir folder;
  const auto expected = rampUpTo(512);
  const auto load = [&](const char* id, const std::string& packed) {
    return zarrValues(writePacked(folder, {{"id", id}, {"level", 1}}, packed));
  };
  const std::string bytes = cubeBytes();
  EXPECT_EQ(load("zlib", zlibbed(bytes)), expected);
  EXPECT_EQ(load("gzip", gzipped(bytes)), expected);
  EXPECT_EQ(load("gzip", gzipped(bytes.substr(0, 100)) + gzipped(bytes.substr(100))), expected)
      << "two members";
  EXPECT_EQ(load("zstd", zstdPacked(bytes)), expected);
  EXPECT_EQ(load("lz4", lz4Packed(bytes)), expected);
  for (const char* compressor : {"lz4", "lz4hc", "zstd", "zlib", "blosclz"})
    for (const int shuffle : {BLOSC_NOSHUFFLE, BLOSC_SHUFFLE, BLOSC_BITSHUFFLE}) {
      const std::string packed = bloscPacked(bytes, compressor, shuffle);
      ASSERT_FALSE(packed.empty()) << compressor;
      EXPECT_EQ(load("blosc", packed), expected) << compressor << shuffle;
    }
}

TEST(ZarrCodecs, SeveralCodecsAreUndoneFromTheLast) {
  const TempDir folder;
  const json document = {{"zarr_format", 3},
                         {"node_type", "array"},
                         {"shape", kCube},
                         {"data_type", "uint16"},
                         {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", kCube}}}}},
                         {"chunk_key_encoding", "default"},
                         {"fill_value", 0},
                         {"codecs",
                          {{{"name", "bytes"}, {"configuration", {{"endian", "little"}}}},
                           {{"name", "zstd"}, {"configuration", {{"level", 3}}}},
                           {{"name", "numcodecs.zlib"}},
                           {{"name", "gzip"}}}}};
  const auto path = writeZarr(
      folder / "a", {{"zarr.json", document.dump()}, {"c/0/0/0", gzipped(zlibbed(zstdPacked(cubeBytes())))}});
  EXPECT_EQ(zarrValues(path), rampUpTo(512));
}

TEST(ZarrCodecs, FiltersAndOtherCompressorsAreRefused) {
  const TempDir folder;
  EXPECT_THAT(
      loadError(writePacked(folder, {{"id", "bz2"}}, "")),
      HasSubstr("a.zarr/.zarray: compressor.id: expected the codec zlib, gzip, zstd, blosc, lz4 or crc32c, "
                "found \"bz2\""));
  json document = array2(kCube, kCube, "<u2");
  document["filters"] = json::array({{{"id", "delta"}}});
  EXPECT_THAT(loadError(writeZarr(folder / "b.zarr", {{".zarray", document.dump()}})),
              HasSubstr("filters: expected no filters, found a list of 1"));
}

TEST(ZarrCodecs, TruncatedAndOverlongChunksAreRefused) {
  const TempDir folder;
  const std::string bytes = cubeBytes(), longer = bytes + "x";
  const std::vector<std::tuple<const char*, std::string, std::string>> cases{
      {"zlib", zlibbed(bytes), zlibbed(longer)},
      {"gzip", gzipped(bytes), gzipped(longer)},
      {"zstd", zstdPacked(bytes), zstdPacked(longer)},
      {"lz4", lz4Packed(bytes), lz4Packed(longer)},
      {"blosc", bloscPacked(bytes, "lz4", 1), bloscPacked(longer, "lz4", 1)}};
  for (const auto& [id, packed, overlong] : cases) {
    const json compressor{{"id", id}};
    EXPECT_EQ(loadError(writePacked(folder, compressor, packed)), "") << id;
    for (std::size_t length = 0; length < packed.size(); length += length < 40 ? 1 : 7)
      EXPECT_THAT(loadError(writePacked(folder, compressor, packed.substr(0, length))),
                  HasSubstr("a.zarr/0.0.0: expected"))
          << id << " " << length;
    EXPECT_THAT(loadError(writePacked(folder, compressor, overlong)), HasSubstr("found damaged data or more"))
        << id;
  }
  EXPECT_THAT(loadError(writePacked(folder, nullptr, longer)),
              HasSubstr("expected a chunk of 1024 bytes, found 1025"));
  EXPECT_THAT(loadError(writePacked(folder, nullptr, std::string(100000, 'x'))),
              HasSubstr("expected at most"));
}

TEST(ZarrCodecs, ABombIsNotUnpacked) {
  const TempDir folder;
  const std::string bomb = gzipped(std::string(64 << 20, '\0'));
  EXPECT_THAT(loadError(writePacked(folder, {{"id", "gzip"}}, bomb), 1 << 20), HasSubstr("expected at most"));
  json document = array2({1, 1, 2}, {1, 1 << 20, 1 << 20}, "|u1");
  const auto path = writeZarr(folder / "b.zarr", {{".zarray", document.dump()}, {"0.0.0", "x"}});
  EXPECT_THAT(loadError(path), HasSubstr("b.zarr/0.0.0: a chunk"));
}

TEST(ZarrCodecs, EveryTruncationOfADocumentIsRefusedOrHarmless) {
  const TempDir folder;
  const std::string whole = array2(kCube, kCube, "<u2").dump();
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(loadError(writeZarr(folder / "a.zarr", {{".zarray", whole.substr(0, length)}})),
                HasSubstr("a.zarr/.zarray: expected JSON"))
        << length;
  EXPECT_THAT(loadError(writeZarr(folder / "a.zarr", {{".zarray", std::string(100000, '[')}})),
              HasSubstr("nested less than 32 deep"));
  EXPECT_THAT(loadError(writeZarr(folder / "a.zarr", {{".zarray", std::string(9 << 20, ' ')}})),
              HasSubstr("expected at most 8388608 bytes, found 9437184"));
  EXPECT_THAT(loadError(writeZarr(folder / "a.zarr", {{".zarray", "[1]"}})),
              HasSubstr("expected a JSON object"));
}

TEST(ZarrCodecs, LinksOutOfTheFolderAreRefused) {
  const TempDir folder;
  writeBytes(folder / "secret", cubeBytes());
  const auto path = writeZarr(folder / "a.zarr", {{".zarray", array2(kCube, kCube, "<u2").dump()}});
  std::filesystem::create_symlink("../secret", path / "0.0.0");
  EXPECT_THAT(loadError(path), HasSubstr("a.zarr/0.0.0: expected a file below the folder, found a link"));
  std::filesystem::remove(path / "0.0.0");
  ASSERT_EQ(mkfifo((path / "0.0.0").c_str(), 0600), 0);
  EXPECT_THAT(loadError(path), HasSubstr("expected a regular file, found a pipe"));
}

}  // namespace
}  // namespace scolopax::io
#endif
