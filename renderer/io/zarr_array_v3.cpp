// SPDX-License-Identifier: Apache-2.0
// Arrays of Zarr version 3: https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html
#include <algorithm>
#include <numeric>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_array.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostCodecs = 16;

/// The name of a codec, grid or encoding, which may be written without the object around it.
std::string nameOfExtension(const ZarrField& field) {
  return field.isText() ? field.text() : field["name"].text();
}

ZarrField configurationOf(const ZarrField& field) {
  static const nlohmann::json kNone;
  return field.isText() ? ZarrField(kNone, field.where()) : field["configuration"];
}

StoredType readZarr3Type(const ZarrField& field) {
  constexpr const char* kExpected = "bool, or an integer or float type of one number";
  if (!field.isText()) field.refuseUnsupported(kExpected);
  if (field.text() == "bool") return StoredType::u8;
  const auto type = storedTypeFromName(field.text());
  if (!type) field.refuseUnsupported(kExpected);
  return *type;
}

std::vector<std::int64_t> chunkShapeOf(const ZarrField& field, std::size_t axes) {
  auto shape = field.integers(kMostZarrAxes, 1, std::int64_t(1) << 48);
  if (shape.size() != axes) field.refuse(std::to_string(axes) + " numbers, as many as shape has");
  return shape;
}

/// Applies a transpose after those so far.
void transposeZarr(const ZarrField& field, std::vector<std::size_t>& order) {
  const auto permutation = field.integers(kMostZarrAxes, 0, std::int64_t(order.size()) - 1);
  std::vector<std::size_t> result, used;
  for (const std::int64_t axis : permutation) {
    result.push_back(order[std::size_t(axis)]);
    used.push_back(std::size_t(axis));
  }
  std::ranges::sort(used);
  if (used.size() != order.size() || std::ranges::adjacent_find(used) != used.end())
    field.refuse("each axis once");
  order = result;
}

void readEndian(const ZarrField& configuration, std::size_t numberBytes, ZarrCodecs& codecs) {
  const ZarrField endian = configuration["endian"];
  if (!endian.exists() && numberBytes == 1) return;
  const std::string order = endian.text();
  if (order != "little" && order != "big") endian.refuse("little or big");
  codecs.bigEndian = order == "big";
}

/// Codecs in the order transpose, bytes, packings. A codec sharding_indexed in place of bytes is handed to
/// `shard`.
template <class Shard>
void readZarr3Codecs(const ZarrField& field, std::size_t numberBytes, ZarrCodecs& codecs, Shard&& shard) {
  bool bytes = false;
  for (const ZarrField& codec : field.list(kMostCodecs)) {
    const std::string name = nameOfExtension(codec);
    const ZarrField configuration = configurationOf(codec);
    const bool beforeBytes = name == "transpose" || name == "bytes" || name == "sharding_indexed";
    if (bytes == beforeBytes)
      field.refuse("transpose, then bytes or sharding_indexed once, then compression");
    if (name == "transpose") {
      transposeZarr(configuration["order"], codecs.order);
    } else if (name == "bytes") {
      readEndian(configuration, numberBytes, codecs);
      bytes = true;
    } else if (name == "sharding_indexed") {
      shard(configuration);
      bytes = true;
    } else {
      codecs.packings.push_back(zarrPackingFromName(codec.where(), name));
    }
  }
  if (!bytes) field.refuse("the codec bytes or sharding_indexed");
}

std::vector<std::size_t> inOrder(std::size_t axes) {
  std::vector<std::size_t> order(axes);
  std::iota(order.begin(), order.end(), std::size_t(0));
  return order;
}

ZarrSharding readSharding(const ZarrField& configuration, const ZarrArray& array) {
  const std::size_t axes = array.shape.size();
  ZarrSharding sharding{.chunks = chunkShapeOf(configuration["chunk_shape"], axes),
                        .codecs = {.order = inOrder(axes)},
                        .index = {.order = inOrder(axes + 1)}};
  for (std::size_t i = 0; i < axes; ++i)
    if (array.chunks[i] % sharding.chunks[i] != 0)
      configuration["chunk_shape"].refuse("a shape that divides that of the shard");
  const auto refuseNested = [](const ZarrField& inner) {
    inner.refuseUnsupported("no shards inside of shards");
  };
  readZarr3Codecs(configuration["codecs"], sizeBytes(array.type), sharding.codecs, refuseNested);
  readZarr3Codecs(configuration["index_codecs"], sizeof(std::uint64_t), sharding.index, refuseNested);
  // The index has a fixed size.
  if (std::ranges::any_of(sharding.index.packings, [](ZarrPacking p) { return p != ZarrPacking::crc32c; }) ||
      sharding.index.order != inOrder(axes + 1))
    configuration["index_codecs"].refuseUnsupported("bytes and crc32c");
  if (const ZarrField location = configuration["index_location"]; location.exists()) {
    sharding.indexAtStart = location.text() == "start";
    if (!sharding.indexAtStart && location.text() != "end") location.refuse("start or end");
  }
  return sharding;
}

void readKeyEncoding(const ZarrNode& node, const ZarrField& field, ZarrArray& array) {
  const std::string name = nameOfExtension(field);
  if (name != "default" && name != "v2") field.refuseUnsupported("default or v2");
  const ZarrField separator = configurationOf(field)["separator"];
  if (separator.exists() && separator.text() != "." && separator.text() != "/")
    separator.refuse("\".\" or \"/\"");
  array.separator = separator.exists() ? separator.text()[0] : name == "v2" ? '.' : '/';
  array.keyPrefix = node.path.empty() ? "" : node.path + "/";
  if (name == "default") (array.keyPrefix += 'c') += array.separator;
}

}  // namespace

void readZarr3(const ZarrNode& node, ZarrArray& array) {
  const ZarrField document = node.field();
  array.type = readZarr3Type(document["data_type"]);
  const ZarrField grid = document["chunk_grid"];
  if (nameOfExtension(grid) != "regular") grid["name"].refuseUnsupported("a regular grid of chunks");
  array.chunks = chunkShapeOf(configurationOf(grid)["chunk_shape"], array.shape.size());
  array.fill = zarrFillValue(document["fill_value"], array.type);
  readKeyEncoding(node, document["chunk_key_encoding"], array);
  const ZarrField transformers = document["storage_transformers"];
  if (transformers.exists() && !transformers.list(kMostCodecs).empty())
    transformers.refuseUnsupported("no storage transformers");

  const ZarrField codecs = document["codecs"];
  readZarr3Codecs(codecs, sizeBytes(array.type), array.codecs, [&](const ZarrField& configuration) {
    array.sharding = readSharding(configuration, array);
  });
  if (array.sharding && (!array.codecs.packings.empty() || array.codecs.order != inOrder(array.shape.size())))
    codecs.refuseUnsupported("sharding_indexed alone");

  const ZarrField names = document["dimension_names"];
  if (!names.exists()) return;
  for (const ZarrField& name : names.list(kMostZarrAxes))
    array.axisNames.push_back(name.exists() ? name.text() : std::string());
  if (array.axisNames.size() != array.shape.size())
    names.refuse(std::to_string(array.shape.size()) + " names, as many as shape has");
}

}  // namespace scolopax::io
