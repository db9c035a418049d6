// SPDX-License-Identifier: Apache-2.0
// Nodes of a Zarr hierarchy, version 2 or 3: groups and arrays, by their documents. Between a store and the
// readers of chunks and of OME metadata.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "renderer/io/stored_type.h"
#include "renderer/io/zarr_codecs.h"
#include "renderer/io/zarr_json.h"
#include "renderer/io/zarr_store.h"

namespace scolopax::io {

inline constexpr std::size_t kMostZarrAxes = 16;

/// How the numbers of a chunk become bytes.
struct ZarrCodecs {
  std::vector<std::size_t> order;  ///< axis i of what is stored is axis order[i]; the last one varies fastest
  bool bigEndian = false;
  std::vector<ZarrPacking> packings = {};  ///< in the order in which they were applied
};

/// A chunk that is a file of smaller chunks: the codec sharding_indexed of version 3.
struct ZarrSharding {
  std::vector<std::int64_t> chunks;  ///< shape of the smaller chunks; divides that of the shard
  ZarrCodecs codecs;                 ///< of the smaller chunks
  ZarrCodecs index;                  ///< of the index: offset and size of each
  bool indexAtStart = false;
};

struct ZarrArray {
  std::vector<std::int64_t> shape;   ///< voxels along each axis, each at least 1
  std::vector<std::int64_t> chunks;  ///< shape of a chunk; whole even at the array's end
  StoredType type = StoredType::u8;
  std::array<std::byte, 8> fill{};  ///< one voxel of a missing chunk, in the byte order of this machine
  std::string keyPrefix;            ///< before the chunk's indices
  char separator = '.';             ///< between them
  ZarrCodecs codecs = {};           ///< without sharding
  std::optional<ZarrSharding> sharding = {};
  std::vector<std::string> axisNames = {};  ///< one for each axis, "" if it has none; or empty
};

/// A group or an array.
struct ZarrNode {
  std::string path;
  int format = 2;
  bool isArray = false;
  nlohmann::json document = nlohmann::json::object();    ///< zarr.json, .zarray or .zgroup
  nlohmann::json attributes = nlohmann::json::object();  ///< .zattrs, or those of zarr.json
  std::string documentName = {}, attributesName = {};    ///< for messages, up to the field

  ZarrField field() const { return {document, documentName}; }
  ZarrField attribute() const { return {attributes, attributesName}; }
};

/// The node of a path, or none if there is none. Throws Error as readZarrJson.
std::optional<ZarrNode> readZarrNode(const ZarrStore& store, const std::string& path);

/// Throws Error: badInput for what the format forbids, unsupported for codecs, types and grids of chunks that
/// cannot be read. Takes no memory of the array's size.
ZarrArray zarrArrayOf(const ZarrNode& node);

/// Reads `fill_value` as one voxel; null is 0.
std::array<std::byte, 8> zarrFillValue(const ZarrField& field, StoredType type);
/// Fills in all that depends on the version.
void readZarr2(const ZarrNode& node, ZarrArray& array);
void readZarr3(const ZarrNode& node, ZarrArray& array);

}  // namespace scolopax::io
