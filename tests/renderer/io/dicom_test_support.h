// SPDX-License-Identifier: Apache-2.0
// DICOM files made element by element, explicit VR little-endian.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {

/// Tests that need the reader.
class DicomTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto format = std::ranges::find(formats(), &matchDicom, &Format::match);
    if (!format->missing.empty()) GTEST_SKIP() << "built without " << format->missing;
  }
};

inline const std::string kExplicitLittle = "1.2.840.10008.1.2.1", kDeflated = "1.2.840.10008.1.2.1.99",
                         kRle = "1.2.840.10008.1.2.5", kJpeg = "1.2.840.10008.1.2.4.50";

inline std::string littleEndian(std::uint64_t value, std::size_t bytes) {
  return bytesOf(std::vector{value}).substr(0, bytes);
}

inline std::string dicomElement(std::uint32_t tag, const std::string& vr, std::string value) {
  if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
  const bool large = vr == "OB" || vr == "OW" || vr == "SQ";
  return littleEndian(tag >> 16, 2) + littleEndian(tag & 0xffff, 2) + vr +
         (large ? std::string(2, '\0') : "") + littleEndian(value.size(), large ? 4 : 2) + value;
}
inline std::string dicomShort(std::uint32_t tag, std::uint64_t value) {
  return dicomElement(tag, "US", littleEndian(value, 2));
}
/// A sequence of items, each of which is the bytes of its elements.
inline std::string dicomSequence(std::uint32_t tag, const std::vector<std::string>& items) {
  std::string bytes;
  for (const std::string& item : items)
    bytes += std::string("\xfe\xff\x00\xe0", 4) + littleEndian(item.size(), 4) + item;
  return dicomElement(tag, "SQ", bytes);
}
/// Compressed pixels: an empty table of offsets and a fragment for each frame.
inline std::string dicomFragments(const std::vector<std::string>& frames) {
  const std::string item("\xfe\xff\x00\xe0", 4);
  std::string bytes = std::string("\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff", 12) + item + std::string(4, '\0');
  for (std::string frame : frames) {
    if (frame.size() % 2 != 0) frame += '\0';
    bytes += item + littleEndian(frame.size(), 4) + frame;
  }
  return bytes + std::string("\xfe\xff\xdd\xe0\0\0\0\0", 8);
}

/// What a test's file says. An empty text leaves the element out.
struct DicomContents {
  std::string syntax = kExplicitLittle;
  std::string sopClass = "1.2.840.10008.5.1.4.1.1.4", modality = "MR", description = "", series = "1.2.3",
              seriesNumber = "7", instance = "1", frames = "";
  std::string position = "0\\0\\0", orientation = "1\\0\\0\\0\\1\\0", spacing = "1\\1", thickness = "",
              sliceSpacing = "";
  int columns = 3, rows = 2, bits = 16, samples = 1, isSigned = 0, planar = 0, bitsStored = 0;
  std::string photometric = "MONOCHROME2";
  std::string slope = "", intercept = "", center = "", width = "";
  std::string others = "";  ///< elements of groups beyond 0028
  std::string pixels = "";  ///< raw; otherwise `pixelElement`
  std::string pixelElement = "";
};

inline std::string dicomBytes(const DicomContents& c) {
  const auto text = [](std::uint32_t tag, const char* vr, const std::string& value) {
    return value.empty() ? "" : dicomElement(tag, vr, value);
  };
  const std::string meta = dicomElement(0x00020010, "UI", c.syntax);
  std::string set = text(0x00080016, "UI", c.sopClass) + text(0x00080060, "CS", c.modality) +
                    text(0x0008103e, "LO", c.description) + dicomElement(0x00100010, "PN", "Secret^Name") +
                    text(0x00180050, "DS", c.thickness) + text(0x00180088, "DS", c.sliceSpacing) +
                    text(0x0020000e, "UI", c.series) + text(0x00200011, "IS", c.seriesNumber) +
                    text(0x00200013, "IS", c.instance) + text(0x00200032, "DS", c.position) +
                    text(0x00200037, "DS", c.orientation) + dicomShort(0x00280002, std::uint64_t(c.samples)) +
                    dicomElement(0x00280004, "CS", c.photometric);
  if (c.samples > 1) set += dicomShort(0x00280006, std::uint64_t(c.planar));
  const std::uint64_t stored = std::uint64_t(c.bitsStored > 0 ? c.bitsStored : c.bits);
  set += text(0x00280008, "IS", c.frames) + dicomShort(0x00280010, std::uint64_t(c.rows)) +
         dicomShort(0x00280011, std::uint64_t(c.columns)) + text(0x00280030, "DS", c.spacing) +
         dicomShort(0x00280100, std::uint64_t(c.bits)) + dicomShort(0x00280101, stored) +
         dicomShort(0x00280102, stored - 1) + dicomShort(0x00280103, std::uint64_t(c.isSigned)) +
         text(0x00281050, "DS", c.center) + text(0x00281051, "DS", c.width) +
         text(0x00281052, "DS", c.intercept) + text(0x00281053, "DS", c.slope) + c.others;
  set +=
      c.pixelElement.empty() ? dicomElement(0x7fe00010, c.bits > 8 ? "OW" : "OB", c.pixels) : c.pixelElement;
  if (c.syntax == kDeflated) {
    const std::string packed = gzipped(set);
    set = packed.substr(10, packed.size() - 18);  // without the header and the checksum of gzip
    if (set.size() % 2 != 0) set += '\0';
  }
  return std::string(128, '\0') + "DICM" + dicomElement(0x00020000, "UL", littleEndian(meta.size(), 4)) +
         meta + set;
}

inline std::string shorts(const std::vector<int>& values) {
  std::vector<std::int16_t> numbers(values.begin(), values.end());
  return bytesOf(numbers);
}

}  // namespace scolopax::io
