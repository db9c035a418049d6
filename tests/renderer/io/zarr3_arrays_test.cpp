// SPDX-License-Identifier: Apache-2.0
// Arrays of Zarr version 3 made here: keys, transposes, shards, and documents that are wrong.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

namespace scolopax::io {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json array3(const ZarrShape& shape, const ZarrShape& chunk, const std::string& type, const json& codecs) {
  return {{"zarr_format", 3},
          {"node_type", "array"},
          {"shape", shape},
          {"data_type", type},
          {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", chunk}}}}},
          {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
          {"fill_value", 0},
          {"codecs", codecs}};
}

json bytesCodec(const char* endian = "little") {
  return {{"name", "bytes"}, {"configuration", {{"endian", endian}}}};
}

/// CRC-32C, bit by bit, in the byte order of files.
std::string crc32c(const std::string& bytes) {
  std::uint32_t rest = ~0u;
  for (const char c : bytes) {
    rest ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) rest = rest >> 1 ^ (rest & 1 ? 0x82F63B78u : 0u);
  }
  return bytesOf<std::uint32_t>({~rest});
}

TEST(Zarr3Arrays, ChecksumIsThatOfTheStandard) {
  EXPECT_EQ(crc32c("123456789"), bytesOf<std::uint32_t>({0xE3069283})) << "RFC 3720's check value";
}

TEST(Zarr3Arrays, KeysByteOrdersAndTransposesLoad) {
  const TempDir folder;
  const ZarrShape shape{3, 4, 5}, chunk{2, 3, 4};
  const auto valuesWith = [&](const json& keys, const std::string& prefix, char separator, const json& codecs,
                              const std::vector<std::size_t>& order, bool big, bool checksum = false) {
    static int number = 0;
    json document = array3(shape, chunk, "int16", codecs);
    document["chunk_key_encoding"] = keys;
    ZarrValues values{{"zarr.json", document.dump()}};
    addChunks(values, shape, chunk, prefix, separator, [&](const ZarrShape& first) {
      const std::string bytes = rampChunk<std::int16_t>(shape, chunk, first, order, big);
      return checksum ? bytes + crc32c(bytes) : bytes;
    });
    return zarrValues(writeZarr(folder / std::to_string(number++), values));
  };
  const json little = json::array({bytesCodec()}), big = json::array({bytesCodec("big")});
  const auto keys = [](const char* name, const char* separator) {
    return json{{"name", name}, {"configuration", {{"separator", separator}}}};
  };
  const auto expected = rampUpTo(60);
  EXPECT_EQ(valuesWith({{"name", "default"}}, "c/", '/', little, {}, false), expected);
  EXPECT_EQ(valuesWith(keys("default", "."), "c.", '.', little, {}, false), expected);
  EXPECT_EQ(valuesWith({{"name", "v2"}}, "", '.', little, {}, false), expected);
  EXPECT_EQ(valuesWith(keys("v2", "/"), "", '/', little, {}, false), expected);
  EXPECT_EQ(valuesWith("default", "c/", '/', big, {}, true), expected);
  const auto transposed = [&](std::vector<std::size_t> first, const json& second) {
    json codecs = json::array({{{"name", "transpose"}, {"configuration", {{"order", first}}}}});
    if (!second.is_null()) codecs.push_back({{"name", "transpose"}, {"configuration", {{"order", second}}}});
    codecs.push_back(bytesCodec());
    return codecs;
  };
  EXPECT_EQ(valuesWith("default", "c/", '/', transposed({2, 0, 1}, nullptr), {2, 0, 1}, false), expected);
  // Axes 0 1 2 become 2 0 1, of which the last comes first: 1 2 0.
  EXPECT_EQ(valuesWith("default", "c/", '/', transposed({2, 0, 1}, {2, 0, 1}), {1, 2, 0}, false), expected);
  EXPECT_EQ(valuesWith("default", "c/", '/', json::array({bytesCodec(), "crc32c"}), {}, false, true),
            expected);
}

/// A shard of chunks at random places, some of them missing.
std::string shardOf(const std::vector<std::string>& chunks, bool atStart, bool big, bool checksum) {
  std::string body;
  std::vector<std::uint64_t> index(chunks.size() * 2, ~std::uint64_t(0));
  const std::size_t before = atStart ? index.size() * 8 + (checksum ? 4 : 0) : 0;
  for (std::size_t i = chunks.size(); i-- > 0;) {
    if (chunks[i].empty()) continue;
    body += "gap";
    index[2 * i] = before + body.size();
    index[2 * i + 1] = chunks[i].size();
    body += chunks[i];
  }
  std::string bytes = bytesOf(index, big);
  if (checksum) bytes += crc32c(bytes);
  return atStart ? bytes + body : body + bytes;
}

struct ShardCase {
  ZarrShape shape{3, 4, 5}, shard{2, 4, 4}, chunk{1, 2, 4};
  bool atStart = false, big = false, checksum = true;

  json codecs() const {
    json index = json::array({bytesCodec(big ? "big" : "little")});
    if (checksum) index.push_back("crc32c");
    return json::array({{{"name", "sharding_indexed"},
                         {"configuration",
                          {{"chunk_shape", chunk},
                           {"codecs", json::array({bytesCodec()})},
                           {"index_codecs", index},
                           {"index_location", atStart ? "start" : "end"}}}}});
  }
  /// The shard that begins at `first`, of chunks f(first voxel).
  std::string bytes(const ZarrShape& first, const std::function<std::string(const ZarrShape&)>& f) const {
    ZarrShape counts;
    for (std::size_t i = 0; i < shape.size(); ++i) counts.push_back(shard[i] / chunk[i]);
    std::vector<std::string> chunks;
    forEachIndex(counts, [&](const ZarrShape& at) {
      ZarrShape voxel;
      for (std::size_t i = 0; i < at.size(); ++i) voxel.push_back(first[i] + at[i] * chunk[i]);
      chunks.push_back(f(voxel));
    });
    return shardOf(chunks, atStart, big, checksum);
  }
  std::string ramp(const ZarrShape& first) const {
    return bytes(first, [&](const ZarrShape& voxel) { return rampChunk<std::int16_t>(shape, chunk, voxel); });
  }
  ZarrValues values() const {
    ZarrValues values{{"zarr.json", array3(shape, shard, "int16", codecs()).dump()}};
    addChunks(values, shape, shard, "c/", '/', [&](const ZarrShape& first) { return ramp(first); });
    return values;
  }
};

TEST(Zarr3Arrays, ShardsOfEveryKindLoad) {
  const TempDir folder;
  int number = 0;
  for (const bool atStart : {false, true})
    for (const bool big : {false, true})
      for (const bool checksum : {false, true}) {
        const ShardCase shards{.atStart = atStart, .big = big, .checksum = checksum};
        EXPECT_EQ(zarrValues(writeZarr(folder / std::to_string(number++), shards.values())), rampUpTo(60));
      }
}

TEST(Zarr3Arrays, MissingChunksOfAShardHaveTheFillValue) {
  const TempDir folder;
  const ShardCase shards{.shape = {2, 2, 4}, .shard = {2, 2, 4}, .chunk = {1, 2, 4}};
  json document = array3(shards.shape, shards.shard, "int16", shards.codecs());
  document["fill_value"] = -7;
  const auto path = writeZarr(folder / "a", {{"zarr.json", document.dump()},
                                             {"c/0/0/0", shards.bytes({0, 0, 0}, [&](const ZarrShape& voxel) {
                                                return voxel[0] == 0 ? std::string()
                                                                     : rampChunk<std::int16_t>(
                                                                           shards.shape, shards.chunk, voxel);
                                              })}});
  EXPECT_EQ(zarrValues(path),
            (std::vector<double>{-7, -7, -7, -7, -7, -7, -7, -7, 8, 9, 10, 11, 12, 13, 14, 15}));
}

TEST(Zarr3Arrays, DamagedShardsAreRefused) {
  const TempDir folder;
  const ShardCase shards{.shape = {2, 2, 4}, .shard = {2, 2, 4}, .chunk = {1, 2, 4}};
  const ZarrValues sound = shards.values();
  const std::string whole = sound.at("c/0/0/0");
  const auto errorWith = [&](const std::string& bytes) {
    ZarrValues values = sound;
    values["c/0/0/0"] = bytes;
    return loadError(writeZarr(folder / "a", values));
  };
  EXPECT_EQ(errorWith(whole), "");
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(errorWith(whole.substr(0, length)), "") << length;
  for (std::size_t at = whole.size() - 36; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = char(damaged[at] ^ 0x40);
    EXPECT_THAT(errorWith(damaged), HasSubstr("a/c/0/0/0: index: expected at most 32 bytes of crc32c")) << at;
  }
  const ShardCase unchecked{.shape = {2, 2, 4}, .shard = {2, 2, 4}, .chunk = {1, 2, 4}, .checksum = false};
  const auto errorOfIndex = [&](const std::vector<std::uint64_t>& index) {
    ZarrValues values = unchecked.values();
    values["c/0/0/0"] = std::string(100, 'x') + bytesOf(index);
    return loadError(writeZarr(folder / "b", values));
  };
  EXPECT_EQ(errorOfIndex({0, 16, 16, 16}), "");
  EXPECT_THAT(errorOfIndex({0, 16, 1000, 16}), HasSubstr("expected 16 bytes at byte 1000, found 132 in all"));
  EXPECT_THAT(errorOfIndex({0, 16, ~0ull - 3, 16}), HasSubstr("found 132 in all"));
  EXPECT_THAT(errorOfIndex({0, 16, 0, ~0ull}), HasSubstr("index: expected at most"));
  EXPECT_THAT(errorOfIndex({0, 16, 0, 8}), HasSubstr("expected a chunk of 16 bytes, found 8"));
}

TEST(Zarr3Arrays, WrongDocumentsAreRefusedWithTheField) {
  const TempDir folder;
  const json sound = array3({1, 1, 2}, {1, 1, 2}, "int16", json::array({bytesCodec()}));
  const auto with = [&](const std::function<void(json&)>& change) {
    json document = sound;
    change(document);
    return loadError(writeZarr(folder / "a", {{"zarr.json", document.dump()}}));
  };
  EXPECT_EQ(with([](json&) {}), "");
  EXPECT_THAT(with([](json& d) { d["zarr_format"] = 4; }),
              HasSubstr("a/zarr.json: zarr_format: expected 3, found 4"));
  EXPECT_THAT(with([](json& d) { d["node_type"] = "tree"; }),
              HasSubstr("node_type: expected array or group"));
  EXPECT_THAT(with([](json& d) { d["shape"] = json::array(); }),
              HasSubstr("shape: expected at least one axis"));
  EXPECT_THAT(with([](json& d) { d["shape"][1] = 0; }), HasSubstr("shape: expected at least one voxel"));
  EXPECT_THAT(with([](json& d) { d["shape"][1] = -1; }),
              HasSubstr("shape[1]: expected a whole number from 0"));
  EXPECT_THAT(with([](json& d) { d["shape"][1] = 1e300; }), HasSubstr("shape[1]: expected a whole number"));
  EXPECT_THAT(with([](json& d) { d["shape"] = {1 << 20, 1 << 20, 1 << 20}; }), HasSubstr("2^48 voxels"));
  EXPECT_THAT(with([](json& d) { d["shape"] = {60000, 60000, 60000}; }), HasSubstr("memory"));
  EXPECT_THAT(with([](json& d) {
                d["shape"] = {1000, 1000, 100}, d["chunk_grid"]["configuration"]["chunk_shape"] = {1, 1, 1};
              }),
              HasSubstr("chunks: expected at most 262144 in a volume, found 100000000"));
  EXPECT_THAT(with([](json& d) { d["data_type"] = "complex64"; }), HasSubstr("data_type: expected bool"));
  EXPECT_THAT(with([](json& d) { d["data_type"] = {{"name", "x"}}; }), HasSubstr("data_type: expected bool"));
  EXPECT_THAT(with([](json& d) { d["chunk_grid"]["name"] = "rectilinear"; }),
              HasSubstr("chunk_grid.name: expected a regular grid of chunks, found \"rectilinear\""));
  auto chunks = [](json& d) -> json& { return d["chunk_grid"]["configuration"]["chunk_shape"]; };
  EXPECT_THAT(with([&](json& d) { chunks(d)[0] = 0; }),
              HasSubstr("chunk_shape[0]: expected a whole number from 1"));
  EXPECT_THAT(with([&](json& d) { chunks(d).erase(0); }), HasSubstr("chunk_shape: expected 3 numbers"));
  EXPECT_THAT(with([](json& d) { d["chunk_key_encoding"] = "other"; }),
              HasSubstr("chunk_key_encoding: expected default or v2"));
  EXPECT_THAT(with([](json& d) { d["storage_transformers"] = {"x"}; }),
              HasSubstr("storage_transformers: expected no"));
  EXPECT_THAT(with([](json& d) { d["dimension_names"] = {"x"}; }),
              HasSubstr("dimension_names: expected 3 names"));
  EXPECT_THAT(with([](json& d) { d["codecs"] = json::array(); }),
              HasSubstr("codecs: expected the codec bytes"));
  EXPECT_THAT(with([](json& d) { d["codecs"].push_back("bytes"); }),
              HasSubstr("codecs: expected transpose, then bytes"));
  EXPECT_THAT(
      with([](json& d) { d["codecs"].push_back("lzma"); }),
      HasSubstr("codecs[1]: expected the codec zlib, gzip, zstd, blosc, lz4 or crc32c, found \"lzma\""));
  EXPECT_THAT(with([](json& d) { d["codecs"] = {"bytes"}; }), HasSubstr("endian: expected text, found none"));
  EXPECT_THAT(
      with([](json& d) {
        d["codecs"] = {{{"name", "transpose"}, {"configuration", {{"order", {0, 0, 1}}}}}, bytesCodec()};
      }),
      HasSubstr("order: expected each axis once"));
}

TEST(Zarr3Arrays, WrongShardsAreRefusedWithTheField) {
  const TempDir folder;
  const ShardCase shards;
  const auto with = [&](const std::function<void(json&)>& change) {
    ZarrValues values = shards.values();
    json document = json::parse(values["zarr.json"]);
    change(document["codecs"][0]["configuration"]);
    values["zarr.json"] = document.dump();
    return loadError(writeZarr(folder / "a", values));
  };
  EXPECT_EQ(with([](json&) {}), "");
  EXPECT_THAT(with([](json& c) { c["chunk_shape"][0] = 3; }),
              HasSubstr("chunk_shape: expected a shape that divides"));
  EXPECT_THAT(with([](json& c) { c["index_location"] = "middle"; }),
              HasSubstr("index_location: expected start or end"));
  EXPECT_THAT(with([](json& c) { c["index_codecs"].push_back("gzip"); }),
              HasSubstr("index_codecs: expected bytes and crc32c"));
  EXPECT_THAT(with([&](json& c) { c["codecs"] = shards.codecs(); }),
              HasSubstr("expected no shards inside of shards"));
}

}  // namespace
}  // namespace scolopax::io
