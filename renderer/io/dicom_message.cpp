// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/dicom_message.h"

#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

using nlohmann::json;

// A frame as numbers, NaN for what it does not say.
constexpr std::size_t kDicomFrameNumbers = 19;
constexpr double kUnsaidInDicom = std::numeric_limits<double>::quiet_NaN();
using DicomFrameNumbers = std::array<double, kDicomFrameNumbers>;

DicomFrameNumbers numbersOfDicomFrame(const DicomFrame& frame) {
  const glm::dvec3 nowhere(kUnsaidInDicom);
  const auto position = frame.position.value_or(nowhere);
  const auto axes = frame.axes.value_or(std::array{nowhere, nowhere});
  const auto spacing = frame.spacing.value_or(glm::dvec2(kUnsaidInDicom));
  const auto window = frame.window.value_or(ValueRange{kUnsaidInDicom, kUnsaidInDicom});
  return {position.x,
          position.y,
          position.z,
          axes[0].x,
          axes[0].y,
          axes[0].z,
          axes[1].x,
          axes[1].y,
          axes[1].z,
          spacing.x,
          spacing.y,
          frame.sliceSpacing.value_or(kUnsaidInDicom),
          frame.thickness.value_or(kUnsaidInDicom),
          frame.slope,
          frame.intercept,
          window.lo,
          window.hi,
          double(frame.time),
          double(frame.segment)};
}

DicomFrame dicomFrameOf(const DicomFrameNumbers& n) {
  const auto said = [&](std::size_t i) { return !std::isnan(n[i]); };
  DicomFrame frame;
  if (said(0)) frame.position = glm::dvec3(n[0], n[1], n[2]);
  if (said(3)) frame.axes = {glm::dvec3(n[3], n[4], n[5]), glm::dvec3(n[6], n[7], n[8])};
  if (said(9)) frame.spacing = glm::dvec2(n[9], n[10]);
  if (said(11)) frame.sliceSpacing = n[11];
  if (said(12)) frame.thickness = n[12];
  frame.slope = n[13];
  frame.intercept = n[14];
  if (said(15)) frame.window = {n[15], n[16]};
  if (std::abs(n[17]) < 1e15) frame.time = std::int64_t(n[17]);
  if (n[18] > 0 && n[18] < 1e6) frame.segment = std::size_t(n[18]);
  return frame;
}

/// Throws Error(badInput) unless later steps can rely on the numbers.
void checkDicomFile(const DicomFile& file) {
  constexpr std::int64_t kMostSide = 65535;
  const auto isType = [&](StoredType type) { return file.type == type; };
  static constexpr std::array kTypes{StoredType::i8,  StoredType::u8,  StoredType::i16,
                                     StoredType::u16, StoredType::i32, StoredType::u32};
  bool good = file.rows >= 1 && file.rows <= kMostSide && file.columns >= 1 && file.columns <= kMostSide &&
              (file.samples == 1 || file.samples == 3) && std::ranges::any_of(kTypes, isType) &&
              !file.frames.empty();
  for (const DicomFrame& frame : file.frames) {
    const auto place = frame.position.value_or(glm::dvec3(0));
    const auto axes = frame.axes.value_or(std::array{glm::dvec3(0), glm::dvec3(0)});
    good = good && glm::length(place) <= kFarthestDicomMm && glm::length(axes[0]) <= 2 &&
           glm::length(axes[1]) <= 2 && std::isfinite(frame.slope) && frame.slope != 0 &&
           std::isfinite(frame.intercept) && frame.segment < std::max<std::size_t>(file.segments.size(), 1);
  }
  if (!good) throw Error(ErrorCode::badInput, shown(file.path) + ": is damaged (its library failed)");
}

}  // namespace

std::vector<std::byte> packDicomFile(const DicomFile& file) {
  json segments = json::array();
  for (const DicomSegment& segment : file.segments) segments.push_back({segment.number, segment.name});
  std::vector<std::uint8_t> frames(file.frames.size() * sizeof(DicomFrameNumbers));
  for (std::size_t i = 0; i < file.frames.size(); ++i) {
    const DicomFrameNumbers numbers = numbersOfDicomFrame(file.frames[i]);
    std::memcpy(frames.data() + i * sizeof numbers, numbers.data(), sizeof numbers);
  }
  const json all{{"seriesUid", file.seriesUid},
                 {"seriesNumber", file.seriesNumber},
                 {"description", file.description},
                 {"unit", file.unit},
                 {"photometric", file.photometric},
                 {"instance", file.instance},
                 {"columns", file.columns},
                 {"rows", file.rows},
                 {"samples", file.samples},
                 {"type", int(file.type)},
                 {"bits", file.bits},
                 {"framesAreTimes", file.framesAreTimes},
                 {"frameTimeMs", file.frameTimeMs},
                 {"labels", file.labels},
                 {"segments", segments},
                 {"warnings", file.warnings},
                 {"frames", json::binary(std::move(frames))}};
  const std::vector<std::uint8_t> bytes = json::to_cbor(all);
  const auto view = std::as_bytes(std::span(bytes));
  return {view.begin(), view.end()};
}

DicomFile unpackDicomFile(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  DicomFile file{.path = path};
  try {
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    const json all = json::from_cbor(first, first + bytes.size());
    all.at("seriesUid").get_to(file.seriesUid);
    all.at("seriesNumber").get_to(file.seriesNumber);
    all.at("description").get_to(file.description);
    all.at("unit").get_to(file.unit);
    all.at("photometric").get_to(file.photometric);
    all.at("instance").get_to(file.instance);
    all.at("columns").get_to(file.columns);
    all.at("rows").get_to(file.rows);
    all.at("samples").get_to(file.samples);
    file.type = StoredType(all.at("type").get<int>());
    all.at("bits").get_to(file.bits);
    all.at("framesAreTimes").get_to(file.framesAreTimes);
    all.at("frameTimeMs").get_to(file.frameTimeMs);
    all.at("labels").get_to(file.labels);
    for (const json& segment : all.at("segments"))
      file.segments.push_back({segment.at(0).get<std::int64_t>(), segment.at(1).get<std::string>()});
    all.at("warnings").get_to(file.warnings);
    const auto& frames = all.at("frames").get_binary();
    for (std::size_t at = 0; at + sizeof(DicomFrameNumbers) <= frames.size();
         at += sizeof(DicomFrameNumbers)) {
      DicomFrameNumbers numbers;
      std::memcpy(numbers.data(), frames.data() + at, sizeof numbers);
      file.frames.push_back(dicomFrameOf(numbers));
    }
  } catch (const json::exception&) {
    file.frames.clear();
  }
  checkDicomFile(file);
  return file;
}

}  // namespace scolopax::io
