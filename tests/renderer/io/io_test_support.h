// SPDX-License-Identifier: Apache-2.0
// Shared by the tests of the loaders: a temporary folder, files made byte by byte, errors as text.
#pragma once
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/io/datasets.h"
#include "renderer/io/formats.h"
#include "renderer/io/nrrd_write.h"

namespace scolopax::io {

inline constexpr std::uint64_t kTestLimit = std::uint64_t(1) << 30;

inline std::filesystem::path dataFile(const std::string& name) {
  return std::filesystem::path(SCOLOPAX_DATA_DIR) / name;
}
#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no test volume " << (path)

/// A new folder for one test.
class TempDir {
 public:
  TempDir() {
    std::string pattern = (std::filesystem::temp_directory_path() / "scolopax-io-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~TempDir() { std::filesystem::remove_all(path_); }
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::filesystem::path writeBytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), std::streamsize(bytes.size()));
  return path;
}

/// `windowBits` as zlib has it: 15 + 16 for gzip, -15 for deflate alone.
inline std::string deflated(std::string_view bytes, int windowBits) {
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, windowBits, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

inline std::string gzipped(std::string_view bytes) { return deflated(bytes, 15 + 16); }

/// The bytes of the values, each in memory order or reversed.
template <class T>
std::string bytesOf(const std::vector<T>& values, bool reversed = false) {
  std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  if (reversed) {
    for (auto at = bytes.begin(); at != bytes.end(); at += sizeof(T)) std::reverse(at, at + sizeof(T));
  }
  return bytes;
}

/// Every voxel of a channel as a data value.
inline std::vector<double> valuesOf(const ChannelSource& channel) {
  return visitScalarType(channel.voxels.type(), [&](auto zero) {
    std::vector<double> values;
    for (const auto stored : channel.voxels.as<decltype(zero)>()) {
      values.push_back(channel.slope * double(stored) + channel.intercept);
    }
    return values;
  });
}

inline std::pair<double, double> rangeOf(const ChannelSource& channel) {
  const auto values = valuesOf(channel);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

/// The first volume of a file, at its finest level.
struct LoadedFile {
  Grid grid;
  std::vector<ChannelSource> channels;
  Times times = {};
  std::string worldUnit = {};
};

inline LoadedFile loadFile(const std::filesystem::path& path, std::uint64_t limit, const Warn& warn,
                           std::size_t time = 0, FourthAxis fourthAxis = FourthAxis::automatic) {
  const auto file = openFile(path, {.fourthAxis = fourthAxis, .warn = warn});
  LoadedPart part = load(*file, {.time = time}, {.memoryLimitBytes = limit, .warn = warn});
  return {part.grid, std::move(part.channels), file->volumes[0].times, file->volumes[0].worldUnit};
}

/// The message, of one line, of the Error that `call` throws; "" if it throws nothing. Any other exception
/// fails the test.
template <class F>
std::string errorOf(F&& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  } catch (const std::exception& other) {
    ADD_FAILURE() << "not a scolopax::Error: " << other.what();
  }
  return "";
}

inline std::string loadError(const std::filesystem::path& path, std::uint64_t limit = kTestLimit) {
  return errorOf([&] { loadFile(path, limit, {}); });
}

}  // namespace scolopax::io
