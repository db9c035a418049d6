// SPDX-License-Identifier: Apache-2.0
// One DICOM file: what its header says of the pictures, and their pixels. The only user of GDCM. From files
// to dicom_series.h.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/stored_type.h"

namespace scolopax::io {

/// The farthest that a picture may be from the origin: sums of such numbers stay finite.
inline constexpr double kFarthestDicomMm = 1e9;

/// One picture of a file. Lengths in mm, in the patient's axes: x to the left, y to the back, z to the head.
struct DicomFrame {
  std::optional<glm::dvec3> position = {};             ///< of the first pixel's centre
  std::optional<std::array<glm::dvec3, 2>> axes = {};  ///< unit vectors along a row and a column
  std::optional<glm::dvec2> spacing = {};              ///< of pixels, along a row and a column
  std::optional<double> sliceSpacing = {}, thickness = {};
  double slope = 1, intercept = 0;  ///< data value = slope * stored + intercept
  std::optional<ValueRange> window = {};
  std::int64_t time = 0;    ///< index in time, as far as the file tells
  std::size_t segment = 0;  ///< index into `segments`
};

/// A label of a segmentation.
struct DicomSegment {
  std::int64_t number = 0;
  std::string name = {};
};

struct DicomFile {
  std::filesystem::path path;
  std::string seriesUid = {}, seriesNumber = {}, description = {};
  std::string unit = {};         ///< of the data values: "HU"
  std::string photometric = {};  ///< "MONOCHROME2", "RGB", ...
  std::int64_t instance = 0;     ///< InstanceNumber
  std::int64_t columns = 1, rows = 1;
  std::size_t samples = 1;  ///< numbers per pixel: 1, or 3 for red, green and blue
  StoredType type = StoredType::u8;
  bool bits = false;            ///< eight pixels a byte, which are decoded to u8
  bool framesAreTimes = false;  ///< of frames without positions
  double frameTimeMs = 0;       ///< between these; 0 if unknown
  bool labels = false;
  std::vector<DicomFrame> frames = {};      ///< at least one
  std::vector<DicomSegment> segments = {};  ///< of a segmentation
  std::vector<std::string> warnings = {};   ///< lines without the file's name

  std::size_t frameBytes() const {
    return std::size_t(columns) * std::size_t(rows) * samples * sizeBytes(type);
  }
};

/// Reads the header, and no pixels. Throws Error: badInput if it is damaged, lacks what pictures need, or if
/// the file cannot hold them; unsupported for what holds no pictures or such as cannot be shown.
DicomFile readDicomFile(const std::filesystem::path& path);

/// Pixels of all frames of a file, in the byte order of this machine.
struct DicomPixels {
  std::vector<std::byte> bytes = {};  ///< frames one after the other, each of frameBytes()
  bool planar = false;                ///< samples are planes within a frame; otherwise they are interleaved
};

/// Memory that decodeDicomFile needs for its result and beside it. Saturates.
std::uint64_t decodingBytes(const DicomFile& file);

/// Decodes the pixels. Throws Error(badInput) if they are damaged or not as `file` says.
DicomPixels decodeDicomFile(const DicomFile& file);

}  // namespace scolopax::io
