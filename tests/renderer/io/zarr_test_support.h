// SPDX-License-Identifier: Apache-2.0
// Zarr hierarchies for tests, made key by key by an encoder of its own.
#pragma once
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {

using ZarrShape = std::vector<std::int64_t>;
using ZarrValues = std::map<std::string, std::string>;  ///< by their keys

inline std::filesystem::path writeZarr(const std::filesystem::path& folder, const ZarrValues& values) {
  for (const auto& [key, bytes] : values) {
    std::filesystem::create_directories((folder / key).parent_path());
    writeBytes(folder / key, bytes);
  }
  return folder;
}

inline std::int64_t countOfShape(const ZarrShape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::int64_t(1), std::multiplies<>());
}

/// Calls f for every index of a shape, the last axis fastest.
inline void forEachIndex(const ZarrShape& shape, const std::function<void(const ZarrShape&)>& f) {
  for (std::int64_t i = 0; i < countOfShape(shape); ++i) {
    ZarrShape index(shape.size());
    std::int64_t rest = i;
    for (std::size_t axis = shape.size(); axis-- > 0; rest /= shape[axis]) index[axis] = rest % shape[axis];
    f(index);
  }
}

/// The bytes of the chunk that begins at `first`, of an array whose values are 0, 1, 2, ..., the last axis
/// fastest; beyond the array they are 99. `order`: see ZarrCodecs.
template <class T>
std::string rampChunk(const ZarrShape& shape, const ZarrShape& chunk, const ZarrShape& first,
                      std::vector<std::size_t> order = {}, bool reversed = false) {
  if (order.empty()) {
    order.resize(shape.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
  }
  ZarrShape stored;
  for (const std::size_t axis : order) stored.push_back(chunk[axis]);
  std::vector<T> values;
  forEachIndex(stored, [&](const ZarrShape& at) {
    ZarrShape index(shape.size());
    for (std::size_t i = 0; i < order.size(); ++i) index[order[i]] = first[order[i]] + at[i];
    std::int64_t value = 0;
    bool inside = true;
    for (std::size_t i = 0; i < shape.size(); ++i) {
      value = value * shape[i] + index[i];
      inside = inside && index[i] < shape[i];
    }
    values.push_back(T(inside ? value : 99));
  });
  return bytesOf(values, reversed);
}

/// All chunks of such an array: f(index, first voxel) gives the bytes.
inline void addChunks(ZarrValues& values, const ZarrShape& shape, const ZarrShape& chunk,
                      const std::string& prefix, char separator,
                      const std::function<std::string(const ZarrShape&)>& bytesAt) {
  ZarrShape counts;
  for (std::size_t i = 0; i < shape.size(); ++i) counts.push_back((shape[i] + chunk[i] - 1) / chunk[i]);
  forEachIndex(counts, [&](const ZarrShape& index) {
    std::string key = prefix;
    ZarrShape first;
    for (std::size_t i = 0; i < index.size(); ++i) {
      if (i > 0) key += separator;
      key += std::to_string(index[i]);
      first.push_back(index[i] * chunk[i]);
    }
    values[key] = bytesAt(first);
  });
}

/// 0, 1, 2, ...
inline std::vector<double> rampUpTo(std::size_t count) {
  std::vector<double> values(count);
  std::iota(values.begin(), values.end(), 0.0);
  return values;
}

inline nlohmann::json array2(const ZarrShape& shape, const ZarrShape& chunks, const std::string& dtype) {
  return {{"zarr_format", 2}, {"shape", shape},        {"chunks", chunks},   {"dtype", dtype},
          {"fill_value", 0},  {"compressor", nullptr}, {"filters", nullptr}, {"order", "C"}};
}

inline const std::string kGroup2 = R"({"zarr_format": 2})";

/// A multiscales document of 0.4: axes by the letters of `axes`, levels "0", "1", ... with these scales.
inline nlohmann::json multiscales(const std::string& axes, const std::vector<std::vector<double>>& scales) {
  nlohmann::json image = {
      {"version", "0.4"}, {"axes", nlohmann::json::array()}, {"datasets", nlohmann::json::array()}};
  for (const char name : axes)
    image["axes"].push_back({{"name", std::string(1, name)},
                             {"type", name == 't'   ? "time"
                                      : name == 'c' ? "channel"
                                                    : "space"}});
  for (std::size_t i = 0; i < scales.size(); ++i)
    image["datasets"].push_back(
        {{"path", std::to_string(i)},
         {"coordinateTransformations", nlohmann::json::array({{{"type", "scale"}, {"scale", scales[i]}}})}});
  return {{"multiscales", nlohmann::json::array({image})}};
}

/// One channel of a volume, in the order of its voxels.
inline std::vector<double> zarrValues(const std::filesystem::path& path, const Part& part = {}) {
  return valuesOf(load(*openFile(path), part, LoadOptions{.memoryLimitBytes = kTestLimit}).channels[0]);
}

inline double sumOf(const ChannelSource& channel) {
  const auto values = valuesOf(channel);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace scolopax::io
