// SPDX-License-Identifier: Apache-2.0
// TIFFs byte by byte, for the tests of TIFF and OME-TIFF.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {

/// An uncompressed TIFF byte by byte: pages of `width` x `height` uint16, unless `tags` say otherwise.
struct TiffBytes {
  bool bigEndian = false, bigTiff = false;
  std::uint32_t width = 3, height = 2;
  std::string description;
  std::map<int, std::uint64_t> tags;  ///< replace or extend the usual ones; all as LONG
  std::map<std::size_t, std::map<int, std::uint64_t>> pageTags;  ///< those of single pages
  std::uint32_t xResolution = 0;                                 ///< pixels per 1000 units; 0 omits the tags
  std::string out;

  void number(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out += char(value >> 8 * (bigEndian ? bytes - 1 - i : i));
  }
  void pair(int tag, int type, std::uint64_t count, std::uint64_t value) {
    const int size = type == 3 ? 2 : 4, room = bigTiff ? 8 : 4;
    number(std::uint64_t(tag), 2), number(std::uint64_t(type), 2), number(count, room);
    if (type == 3 || type == 4)
      number(value, size), number(0, room - size);
    else
      number(value, room);
  }

  /// `data[i]` are the bytes of page i, in the file's order; `tail` follows the last page's.
  std::string build(const std::vector<std::string>& data) {
    out = bigEndian ? "MM" : "II";
    number(bigTiff ? 43 : 42, 2);
    if (bigTiff) number(8, 2), number(0, 2);
    const int room = bigTiff ? 8 : 4;
    number(out.size() + std::size_t(room), room);
    for (std::size_t i = 0; i < data.size(); ++i) {
      std::map<int, std::uint64_t> all{{256, width}, {257, height}, {258, 16},
                                       {259, 1},     {262, 1},      {273, 0},
                                       {277, 1},     {278, height}, {279, data[i].size()}};
      for (const auto& [tag, value] : tags) all[tag] = value;
      for (const auto& [tag, value] : pageTags[i]) all[tag] = value;
      if (i == 0 && !description.empty()) all[270] = 0;
      if (xResolution > 0) all[282] = all[283] = 0;
      const std::size_t entries = all.size(),
                        directory = (bigTiff ? 8 : 2) + entries * (bigTiff ? 20 : 12) + std::size_t(room);
      const std::size_t text = out.size() + directory,
                        ratio = text + (i == 0 && !description.empty() ? description.size() + 1 : 0);
      const std::size_t pixels = ratio + (xResolution > 0 ? 8 : 0);
      number(entries, bigTiff ? 8 : 2);
      for (const auto& [tag, value] : all) {
        if (tag == 270)
          pair(270, 2, description.size() + 1, text);
        else if (tag == 273)
          pair(273, 4, 1, value ? value : pixels);
        else if (tag == 282 || tag == 283)
          pair(tag, 5, 1, ratio);
        else
          pair(tag, tag == 258 || tag == 259 || tag == 262 || tag == 277 ? 3 : 4, 1, value);
      }
      number(i + 1 < data.size() ? pixels + data[i].size() : 0, room);
      if (i == 0 && !description.empty()) out += description + '\0';
      if (xResolution > 0) number(xResolution, 4), number(1000, 4);
      out += data[i];
    }
    return out;
  }
};

}  // namespace scolopax::io
