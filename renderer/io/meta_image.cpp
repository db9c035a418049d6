// SPDX-License-Identifier: Apache-2.0
// MetaImage (itk.org/Wiki/ITK/MetaIO/Documentation), the format of ITK and VTK: a text header, with the
// voxels behind it or in files that it names, plain or zlib. Parsed by hand: the header is simple text.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/meta_image_data.h"
#include "renderer/io/meta_image_header.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// What the header says of the voxels.
struct MetaImage {
  std::vector<std::int64_t> dims;  ///< of one to four axes
  VoxelLayout layout;              ///< of one volume; the samples are interleaved channels
  Grid grid;
  Times times;
  std::size_t fourth = 1;         ///< size of the fourth axis
  bool fourthIsChannels = false;  ///< otherwise it is times
  double slope = 1, intercept = 0;
};

StoredType metaImageType(const MetaImageHeader& header) {
  // MET_LONG has 4 bytes on every machine.
  static const std::map<std::string_view, StoredType> kTypes = {
      {"MET_CHAR", StoredType::i8},        {"MET_UCHAR", StoredType::u8},  {"MET_SHORT", StoredType::i16},
      {"MET_USHORT", StoredType::u16},     {"MET_INT", StoredType::i32},   {"MET_UINT", StoredType::u32},
      {"MET_LONG", StoredType::i32},       {"MET_ULONG", StoredType::u32}, {"MET_LONG_LONG", StoredType::i64},
      {"MET_ULONG_LONG", StoredType::u64}, {"MET_FLOAT", StoredType::f32}, {"MET_DOUBLE", StoredType::f64},
  };
  const std::string_view name = header.require("ElementType");
  std::string_view scalar = name;
  if (scalar.ends_with("_ARRAY")) scalar.remove_suffix(6);  // of the channels
  const auto found = kTypes.find(scalar);
  if (found == kTypes.end())
    throw header.unsupported("ElementType", "a type of numbers such as MET_SHORT", name);
  return found->second;
}

std::vector<std::int64_t> metaImageDims(const MetaImageHeader& header) {
  header.require("NDims");
  const std::int64_t axes = header.integer("NDims", 0, 1);
  if (axes > 4) throw header.unsupported("NDims", "1 to 4", header.require("NDims"));
  const std::string_view text = header.require("DimSize");
  std::vector<std::int64_t> dims;
  for (const std::string_view word : splitWords(text)) {
    const auto size = parseInteger(word);
    if (!size || *size < 1) throw header.bad("DimSize", "whole numbers, 1 or more", text);
    dims.push_back(*size);
  }
  if (std::int64_t(dims.size()) != axes)
    throw header.bad("DimSize", std::to_string(axes) + " numbers as NDims says", text);
  return dims;
}

/// Directions of the voxel axes in LPS by letters such as "RAI", which tell where each axis begins; none
/// unless each of the three axes of the body is there once.
std::optional<glm::dmat3> anatomicalDirections(std::string_view letters) {
  constexpr std::string_view kBegins = "RAI", kEnds = "LPS";
  if (letters.size() != 3) return std::nullopt;
  glm::dmat3 directions(0.0);
  for (int i = 0; i < 3; ++i) {
    const auto begin = kBegins.find(letters[std::size_t(i)]), end = kEnds.find(letters[std::size_t(i)]);
    if (begin == std::string_view::npos && end == std::string_view::npos) return std::nullopt;
    const bool forward = begin != std::string_view::npos;
    directions[i][int(forward ? begin : end)] = forward ? 1 : -1;
  }
  if (std::abs(glm::determinant(directions)) < 0.5) return std::nullopt;
  return directions;
}

/// Directions of the voxel axes in LPS: column i is that of axis i, which the header has as row i.
glm::dmat3 metaImageDirections(const MetaImageHeader& header, std::size_t axes, const Warn& warn) {
  const auto matrix = header.numbers({"TransformMatrix", "Rotation", "Orientation"}, axes * axes);
  const auto anatomical =
      axes < 3 ? std::nullopt : anatomicalDirections(header.find({"AnatomicalOrientation"}).value_or(""));
  if (matrix.empty()) return anatomical.value_or(glm::dmat3(1.0));
  glm::dmat3 directions(1.0);
  for (std::size_t i = 0; i < axes; ++i) {
    for (std::size_t j = 0; j < axes; ++j) {
      const double value = matrix[i * axes + j];
      if (i < 3 && j < 3)
        directions[int(i)][int(j)] = value;
      else if (i != j && value != 0)
        throw header.unsupported("TransformMatrix", "a fourth axis apart from the others",
                                 *header.find({"TransformMatrix", "Rotation", "Orientation"}));
    }
  }
  // An oblique volume has the letters of the axes that are nearest.
  for (int i = 0; anatomical && i < 3; ++i) {
    if (glm::dot((*anatomical)[i], directions[i]) > 0) continue;
    warn(header.file + ": AnatomicalOrientation: is not used, as TransformMatrix says otherwise");
    break;
  }
  return directions;
}

void setMetaImageGrid(const MetaImageHeader& header, MetaImage& image, const Warn& warn) {
  const std::size_t axes = image.dims.size();
  auto spacing = header.numbers({"ElementSpacing", "ElementSize"}, axes);
  const bool hasSpacing = !spacing.empty();
  spacing.resize(4, 1.0);
  auto origin = header.numbers({"Offset", "Position", "Origin"}, axes);
  origin.resize(4, 0.0);
  const glm::dmat3 directions = metaImageDirections(header, axes, warn);
  const glm::dvec3 rasFromLps(-1, -1, 1);
  image.grid.dims = image.layout.dims;
  glm::dmat4& m = image.grid.worldFromVoxel;
  for (int i = 0; i < 3; ++i) {
    double& step = spacing[std::size_t(i)];
    if (step == 0) {
      warn(header.file + ": ElementSpacing: 0, taken as 1");
      step = 1;
    }
    m[i] = glm::dvec4(rasFromLps * directions[i] * step, 0);
  }
  m[3] = glm::dvec4(rasFromLps * glm::dvec3(origin[0], origin[1], origin[2]), 1);
  if (axes < 4 || image.fourthIsChannels) return;
  image.times.count = image.fourth;
  constexpr std::size_t kMostTimeValues = 1 << 20;
  if (!hasSpacing || !(spacing[3] > 0) || image.fourth > kMostTimeValues) return;
  for (std::size_t i = 0; i < image.fourth; ++i)
    image.times.values.push_back(origin[3] + double(i) * spacing[3]);
}

/// The sizes, and what the fourth axis is: times, as the format has a field of its own for channels.
void setMetaImageLayout(const MetaImageHeader& header, const OpenOptions& options, MetaImage& image) {
  constexpr std::int64_t kMostMetaImageChannels = 4096, kMostMetaImageTimes = 1 << 24;
  image.dims = metaImageDims(header);
  const auto size = [&](std::size_t axis) { return axis < image.dims.size() ? image.dims[axis] : 1; };
  VoxelLayout& layout = image.layout;
  layout.dims = checkedDims(header.file + ": DimSize", size(0), size(1), size(2));
  layout.type = metaImageType(header);
  layout.bigEndian = header.flag({"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}, false);
  if (header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false) != layout.bigEndian)
    throw header.bad("ElementByteOrderMSB", "the same as in BinaryDataByteOrderMSB",
                     header.require("ElementByteOrderMSB"));
  const std::int64_t channels = header.integer("ElementNumberOfChannels", 1, 1);
  image.fourthIsChannels = image.dims.size() == 4 && options.fourthAxis == FourthAxis::channel;
  if (channels > kMostMetaImageChannels)
    throw header.unsupported("ElementNumberOfChannels", "at most 4096", std::to_string(channels));
  const std::int64_t most = image.fourthIsChannels ? kMostMetaImageChannels : kMostMetaImageTimes;
  if (size(3) > most)
    throw header.unsupported("DimSize", "at most " + std::to_string(most) + " along the fourth axis",
                             std::to_string(size(3)));
  if (image.fourthIsChannels && channels > 1)
    throw header.unsupported("ElementNumberOfChannels", "1 if the fourth axis is channels",
                             std::to_string(channels));
  layout.samples = std::size_t(channels);
  layout.interleaved = true;
  image.fourth = std::size_t(size(3));
}

MetaImage describeMetaImage(const MetaImageHeader& header, const OpenOptions& options) {
  if (const auto type = header.find({"ObjectType"}); type && *type != "Image")
    throw header.unsupported("ObjectType", "Image", *type);
  if (!header.flag({"BinaryData"}, true))
    throw header.unsupported("BinaryData", "True, as voxels in text are not read", "False");
  MetaImage image;
  setMetaImageLayout(header, options, image);
  setMetaImageGrid(header, image, options.warn);
  const auto slope = header.numbers({"ElementToIntensityFunctionSlope"}, 1),
             intercept = header.numbers({"ElementToIntensityFunctionOffset"}, 1);
  if (!slope.empty()) image.slope = slope[0];
  if (!intercept.empty()) image.intercept = intercept[0];
  if (image.slope == 0) throw header.bad("ElementToIntensityFunctionSlope", "a number other than 0", "0");
  return image;
}

/// MetaIO's default are millimetres, as ITK and VTK take them.
std::string metaImageUnit(const MetaImageHeader& header) {
  const std::string unit = lowerCase(header.find({"DistanceUnits"}).value_or(""));
  return unit == "um" || unit == "cm" ? unit : "mm";
}

/// Reads one volume: these samples of every voxel with these writers.
void readMetaImageVolume(MetaImageStream& stream, const VoxelLayout& layout, std::size_t index,
                         const std::vector<std::size_t>& samples, std::span<ChannelWriter> writers) {
  stream.skipTo(index * layout.sizeBytes());
  readInterleaved(stream, layout, samples, writers);
}

}  // namespace

Match matchMetaImage(const FileStart& start) {
  // There are no magic bytes: the first line is one of the format's fields, and its sizes follow.
  const std::string_view text = start.bytes;
  const auto name = trimmed(text.substr(0, text.find_first_of("=:\n")));
  const bool sized =
      text.find("NDims") != std::string_view::npos && text.find("DimSize") != std::string_view::npos;
  if (sized && (isMetaImageField(name) || name == "Comment")) return Match::content;
  const bool named = start.hasEnding(".mha") || start.hasEnding(".mhd");
  return named && !start.folder ? Match::name : Match::no;
}

VolumeFile openMetaImage(const fs::path& path, const OpenOptions& options) {
  const MetaImageHeader header(path);
  const MetaImage image = describeMetaImage(header, options);
  const VoxelLayout& layout = image.layout;
  const MetaImageData data =
      findMetaImageData(header, path, image.dims, sizeBytes(layout.type) * layout.samples);
  VolumeFile file{path};
  if (data.files != std::vector{path}) file.dataFiles = data.files;
  const std::size_t channels = image.fourthIsChannels ? image.fourth : layout.samples;
  const ChannelInfo channel{.type = layout.type, .slope = image.slope, .intercept = image.intercept};
  file.volumes = {{.levels = {image.grid},
                   .times = image.times,
                   .channels = std::vector<ChannelInfo>(channels, channel),
                   .worldUnit = metaImageUnit(header)}};
  file.read = [data, layout, areChannels = image.fourthIsChannels, name = header.file](
                  const VolumeInfo& volume, const Part& part, Loading& loading) {
    auto writers = makeWriters(name, volume, part, loading);
    MetaImageStream stream(data, loading);
    if (!areChannels) readMetaImageVolume(stream, layout, part.time, part.channels, writers);
    for (std::size_t i = 0; areChannels && i < part.channels.size(); ++i)
      readMetaImageVolume(stream, layout, part.channels[i], {0}, std::span(writers).subspan(i, 1));
    return takeAll(writers);
  };
  return file;
}

}  // namespace scolopax::io
