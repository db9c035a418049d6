// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/dicom_frames.h"

#if SCOLOPAX_HAS_GDCM
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "renderer/io/dicom_elements.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

[[noreturn]] void failDicomField(const std::string& name, const char* field, const char* expected,
                                 const std::string& found) {
  throw Error(ErrorCode::badInput, name + ": " + field + ": expected " + expected + ", found " + found);
}

/// Numbers of an element that must be `count` if there are any.
std::vector<double> dicomNumbers(const gdcm::DataSet& set, const DicomTag& tag, std::size_t count,
                                 const std::string& name, const char* field) {
  const std::string text = dicomText(set, tag);
  if (text.empty()) return {};
  std::vector<double> values = dicomDecimals(set, tag);
  if (values.size() < count)
    failDicomField(name, field, (std::to_string(count) + (count == 1 ? " number" : " numbers")).c_str(),
                   inQuotes(text));
  return values;
}

void takeDicomPosition(const gdcm::DataSet& set, const std::string& name, DicomFrame& frame) {
  const auto p = dicomNumbers(set, dicom::kPosition, 3, name, "ImagePositionPatient");
  if (p.empty()) return;
  if (!(std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) <= kFarthestDicomMm))
    failDicomField(name, "ImagePositionPatient", "at most 1e9 mm",
                   inQuotes(dicomText(set, dicom::kPosition)));
  frame.position = glm::dvec3(p[0], p[1], p[2]);
}

void takeDicomOrientation(const gdcm::DataSet& set, const std::string& name, DicomFrame& frame) {
  constexpr double kTolerance = 1e-2;
  const auto v = dicomNumbers(set, dicom::kOrientation, 6, name, "ImageOrientationPatient");
  if (v.empty()) return;
  const glm::dvec3 row(v[0], v[1], v[2]), column(v[3], v[4], v[5]);
  if (!(std::abs(glm::length(row) - 1) < kTolerance && std::abs(glm::length(column) - 1) < kTolerance &&
        std::abs(glm::dot(row, column)) < kTolerance))
    failDicomField(name, "ImageOrientationPatient", "two unit vectors at right angles",
                   inQuotes(dicomText(set, dicom::kOrientation)));
  frame.axes = {glm::normalize(row), glm::normalize(column)};
}

void takeDicomPositiveNumber(const gdcm::DataSet& set, const DicomTag& tag, std::optional<double>& number) {
  const auto value = dicomDecimal(set, tag);  // some write 0 or a negative distance
  if (value && std::abs(*value) > 0) number = std::abs(*value);
}

void takeDicomMeasures(const gdcm::DataSet& set, const std::string& name, DicomFrame& frame) {
  for (const auto& [tag, field] :
       {std::pair{dicom::kPixelSpacing, "PixelSpacing"}, {dicom::kDetectorSpacing, "ImagerPixelSpacing"}}) {
    const auto spacing = dicomNumbers(set, tag, 2, name, field);
    if (spacing.empty()) continue;
    if (!(spacing[0] > 0 && spacing[1] > 0))
      failDicomField(name, field, "two positive numbers", inQuotes(dicomText(set, tag)));
    frame.spacing = glm::dvec2(spacing[1], spacing[0]);  // the file's first one is between rows
    break;
  }
  takeDicomPositiveNumber(set, dicom::kThickness, frame.thickness);
  takeDicomPositiveNumber(set, dicom::kSliceSpacing, frame.sliceSpacing);
}

void takeDicomRescale(const gdcm::DataSet& set, const std::string& name, DicomFrame& frame) {
  const auto slope = dicomNumbers(set, dicom::kSlope, 1, name, "RescaleSlope");
  const auto intercept = dicomNumbers(set, dicom::kIntercept, 1, name, "RescaleIntercept");
  const auto dose = dicomNumbers(set, dicom::kDoseScaling, 1, name, "DoseGridScaling");
  if (!slope.empty()) frame.slope = slope[0];
  if (!intercept.empty()) frame.intercept = intercept[0];
  if (!dose.empty()) frame.slope = dose[0];
  if (frame.slope == 0) failDicomField(name, "RescaleSlope", "a number other than 0", "0");
}

/// PS3.3 C.11.2.1.2.
void takeDicomWindow(const gdcm::DataSet& set, DicomFrame& frame) {
  const auto center = dicomDecimal(set, dicom::kCenter), width = dicomDecimal(set, dicom::kWidth);
  if (!center || !width) return;
  const std::string function = dicomText(set, dicom::kWindowFunction);
  if (function == "LINEAR_EXACT" && *width > 0)
    frame.window = {*center - *width / 2, *center + *width / 2};
  else if (function != "SIGMOID" && *width > 1)
    frame.window = {*center - 0.5 - (*width - 1) / 2, *center - 0.5 + (*width - 1) / 2};
}

/// What the functional groups of all frames, or of one, say.
void takeDicomGroups(const gdcm::DataSet& groups, const std::string& name, const DicomFile& file,
                     DicomFrame& frame) {
  withDicomItem(groups, dicom::kPositionGroup, [&](const auto& set) { takeDicomPosition(set, name, frame); });
  withDicomItem(groups, dicom::kOrientationGroup,
                [&](const auto& set) { takeDicomOrientation(set, name, frame); });
  withDicomItem(groups, dicom::kMeasuresGroup, [&](const auto& set) { takeDicomMeasures(set, name, frame); });
  withDicomItem(groups, dicom::kRescaleGroup, [&](const auto& set) { takeDicomRescale(set, name, frame); });
  withDicomItem(groups, dicom::kWindowGroup, [&](const auto& set) { takeDicomWindow(set, frame); });
  withDicomItem(groups, dicom::kContentGroup, [&](const auto& set) {
    frame.time = dicomUnsigned(set, dicom::kContentTimeIndex).value_or(frame.time);
  });
  withDicomItem(groups, dicom::kSegmentGroup, [&](const auto& set) {
    const auto number = dicomUnsigned(set, dicom::kReferencedSegment);
    const auto segment = std::ranges::find_if(
        file.segments, [&](const DicomSegment& candidate) { return candidate.number == number; });
    if (segment == file.segments.end() && !file.segments.empty())
      failDicomField(name, "ReferencedSegmentNumber", "one of SegmentSequence",
                     number ? std::to_string(*number) : "none");
    frame.segment = std::size_t(segment - file.segments.begin());
  });
}

/// Frames of files without functional groups follow each other along the normal, or in time.
void placeDicomFrames(const gdcm::DataSet& elements, const std::string& name, DicomFile& file) {
  const std::size_t count = file.frames.size();
  if (count == 1) return;
  const DicomFrame first = file.frames[0];
  const auto offsets = dicomNumbers(elements, dicom::kDoseOffsets, count, name, "GridFrameOffsetVector");
  file.framesAreTimes = offsets.empty() && (!dicomText(elements, dicom::kFrameTime).empty() ||
                                            !dicomText(elements, dicom::kFrameTimes).empty());
  file.frameTimeMs = std::max(dicomDecimal(elements, dicom::kFrameTime).value_or(0), 0.0);
  if (!first.position || !first.axes || file.framesAreTimes) {
    for (std::size_t i = 0; i < count && file.framesAreTimes; ++i) file.frames[i].time = std::int64_t(i);
    return;
  }
  const glm::dvec3 normal = glm::cross((*first.axes)[0], (*first.axes)[1]);
  const double step = first.sliceSpacing.value_or(first.thickness.value_or(1));
  for (std::size_t i = 0; i < count; ++i)
    file.frames[i].position =
        *first.position + normal * (offsets.empty() ? double(i) * step : offsets[i] - offsets[0]);
}

}  // namespace

void readDicomFrames(const gdcm::DataSet& elements, const std::string& name, std::size_t count,
                     DicomFile& file) {
  DicomFrame first;
  takeDicomPosition(elements, name, first);
  takeDicomOrientation(elements, name, first);
  takeDicomMeasures(elements, name, first);
  takeDicomRescale(elements, name, first);
  takeDicomWindow(elements, first);
  first.time = parseInteger(dicomText(elements, dicom::kTimeIndex)).value_or(0);
  withDicomItem(elements, dicom::kDetectors, [&](const auto& set) {  // nuclear medicine
    if (!first.position) takeDicomPosition(set, name, first);
    if (!first.axes) takeDicomOrientation(set, name, first);
  });
  const auto fraction = dicomUnsigned(elements, dicom::kLargestFraction);
  if (fraction && *fraction > 0 && !file.labels) first.slope = 1 / double(*fraction);
  withDicomItem(elements, dicom::kShared, [&](const auto& set) { takeDicomGroups(set, name, file, first); });
  file.frames.assign(count, first);
  std::size_t groups = 0;
  visitDicomItems(elements, dicom::kPerFrame, [&](const gdcm::DataSet& set) {
    if (groups < count) takeDicomGroups(set, name, file, file.frames[groups]);
    ++groups;
    return true;
  });
  if (groups == 0) return placeDicomFrames(elements, name, file);
  if (groups < count)
    failDicomField(name, "PerFrameFunctionalGroupsSequence", (std::to_string(count) + " items").c_str(),
                   std::to_string(groups));
  if (groups > count)
    file.warnings.push_back("has " + std::to_string(groups) + " functional groups for " +
                            std::to_string(count) + " frames; the others are ignored");
}

}  // namespace scolopax::io
#endif
