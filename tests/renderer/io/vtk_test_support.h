// SPDX-License-Identifier: Apache-2.0
// VTK files made byte by byte: arrays in every coding of the XML formats.
#pragma once
#include <zlib.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {

inline std::string base64(std::string_view bytes) {
  static constexpr std::string_view kAlphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kAlphabet[bits >> (18 - 6 * k) & 63];
  }
  return text;
}

inline std::string zlibPacked(std::string_view bytes) {
  uLongf size = compressBound(uLong(bytes.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           uLong(bytes.size()));
  packed.resize(size);
  return packed;
}

/// LZ4 without matches: a token, the length in bytes of 255, the bytes themselves.
inline std::string lz4Stored(std::string_view bytes) {
  std::string packed(1, char(std::min<std::size_t>(bytes.size(), 15) << 4));
  if (bytes.size() >= 15) {
    std::size_t rest = bytes.size() - 15;
    for (; rest >= 255; rest -= 255) packed += '\xFF';
    packed += char(rest);
  }
  return packed.append(bytes);
}

/// How a file writes its arrays.
struct VtkCodingOfTest {
  bool big = false;
  bool wide = false;        ///< sizes of 64 bits
  std::string packer = {};  ///< "", "zlib" or "lz4"
  std::size_t blockBytes = 16;

  std::string size(std::uint64_t number) const {
    return wide ? bytesOf(std::vector{number}, big) : bytesOf(std::vector{std::uint32_t(number)}, big);
  }
  /// Sizes and data: each is encoded by itself if the data are compressed, both together otherwise.
  std::pair<std::string, std::string> parts(std::string_view data) const {
    if (packer.empty()) return {"", size(data.size()) + std::string(data)};
    std::string sizes, blocks;
    std::uint64_t count = 0;
    for (std::size_t at = 0; at < data.size(); at += blockBytes, ++count) {
      const std::string_view block = data.substr(at, blockBytes);
      const std::string packed = packer == "zlib" ? zlibPacked(block) : lz4Stored(block);
      sizes += size(packed.size());
      blocks += packed;
    }
    return {size(count) + size(blockBytes) + size(data.size() % blockBytes) + sizes, blocks};
  }
  std::string raw(std::string_view data) const { return parts(data).first + parts(data).second; }
  std::string text(std::string_view data) const {
    return base64(parts(data).first) + base64(parts(data).second);
  }
  std::string attributes() const {
    return std::string(" byte_order=\"") + (big ? "BigEndian" : "LittleEndian") + "\" header_type=\"" +
           (wide ? "UInt64" : "UInt32") + "\"" +
           (packer.empty()     ? ""
            : packer == "zlib" ? " compressor=\"vtkZLibDataCompressor\""
                               : " compressor=\"vtkLZ4DataCompressor\"");
  }
};

using VtkValues = std::vector<double>;

inline LoadedFile loadVtk(const std::filesystem::path& path) { return loadFile(path, kTestLimit, {}); }

inline std::vector<std::string> vtkNames(const LoadedFile& file) {
  std::vector<std::string> names;
  for (const ChannelSource& channel : file.channels) names.push_back(channel.name);
  return names;
}

inline double vtkSum(const ChannelSource& channel) {
  const VtkValues values = valuesOf(channel);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

inline std::string vtkShorts(int count, int first = 0, bool big = false) {
  std::vector<std::int16_t> numbers(static_cast<std::size_t>(count));
  std::iota(numbers.begin(), numbers.end(), std::int16_t(first));
  return bytesOf(numbers, big);
}

inline VtkValues vtkRamp(int first, int count, int step = 1) {
  VtkValues values;
  for (int i = 0; i < count; ++i) values.push_back(first + i * step);
  return values;
}

inline std::string vtkFileText(const std::string& type, const std::string& attributes,
                               const std::string& inside, const std::string& behind = "") {
  return "<?xml version=\"1.0\"?>\n<!-- a > b's -->\n<VTKFile type=\"" + type + "\" version=\"1.0\"" +
         attributes + ">\n" + inside + behind + "</VTKFile>\n";
}

inline std::string vtkArrayText(const std::string& type, const std::string& name, const std::string& more,
                                const std::string& text = "") {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" " + more + ">\n  " + text +
         "\n</DataArray>\n";
}

/// An image of 2x3x2 points, whose arrays are `points` and `cells`.
inline std::string vtkImageText(const std::string& points, const std::string& cells = "",
                                const std::string& attributes = "") {
  return "<ImageData WholeExtent=\"0 1 0 2 0 1\" " + attributes +
         "><Piece Extent=\"0 1 0 2 0 1\"><PointData>" + points + "</PointData><CellData>" + cells +
         "</CellData></Piece></ImageData>";
}

}  // namespace scolopax::io
