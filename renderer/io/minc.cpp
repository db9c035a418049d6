// SPDX-License-Identifier: Apache-2.0
// MINC 2 (en.wikibooks.org/wiki/MINC): HDF5 of medical images, millimetres in
// RAS. Integers are scaled between the values of image-min and image-max, which
// may differ from slice to slice.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/hdf5.h"
#include "renderer/io/hdf5_library.h"
#include "renderer/io/text.h"

namespace scolopax::io {

Match matchMinc(const FileStart& start) {
  return start.hasEnding(".mnc") && isHdf5(start.bytes) ? Match::content : Match::no;
}

#if SCOLOPAX_HAS_HDF5
namespace {

constexpr std::string_view kMincImage = "/minc-2.0/image/0/image";

/// Real values of the smallest and the largest stored number, for each slice or
/// slab, or one for all.
struct MincScale {
  double lowest = 0, highest = 0;  ///< stored numbers
  std::vector<double> low,
      high;                         ///< of equal size; empty: numbers are as they are
  std::vector<std::uint64_t> dims;  ///< of `low`: the image's first dimensions
};

/// The image's dimensions by their names, the slowest first.
std::vector<std::string> mincDimensions(const std::string& where, const ArrayNode& image) {
  std::string order = image.joined("dimorder");
  std::ranges::replace(order, ',', ' ');
  std::vector<std::string> names;
  for (const std::string_view name : splitWords(order)) names.emplace_back(name.substr(0, name.find('\0')));
  if (names.size() != image.dims.size())
    failBadInput(where + ": dimorder: expected the names of " + std::to_string(image.dims.size()) +
                 " dimensions, found " + inQuotes(order));
  return names;
}

std::string mincRoles(const std::string& where, const std::vector<std::string>& names) {
  std::string roles;
  for (const std::string& name : names) {
    if (name == "xspace" || name == "yspace" || name == "zspace")
      roles += name[0];
    else if (name == "time")
      roles += 't';
    else if (name == "vector_dimension")
      roles += 'c';
    else
      throw Error(ErrorCode::unsupported, where +
                                              ": dimorder: expected xspace, yspace, zspace, time or "
                                              "vector_dimension, found " +
                                              inQuotes(name));
  }
  std::string sorted = roles;
  std::ranges::sort(sorted);
  if (std::ranges::adjacent_find(sorted) != sorted.end())
    failBadInput(where + ": dimorder: expected each dimension once, found one twice");
  return roles;
}

Grid mincGrid(const Hdf5File& file, const ArrayNode& image, const std::string& roles) {
  const std::string where = file.name + ":" + cleanText(image.path);
  Grid grid{dimsOf(where, image, roles)};
  glm::dvec3 origin(0);
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name = std::string(1, "xyz"[axis]) + "space";
    const ArrayNode* dimension = file.tree.find("/minc-2.0/dimensions/" + name);
    if (!dimension || roles.find(name[0]) == std::string::npos) continue;
    if (dimension->joined("spacing").starts_with("irregular"))
      throw Error(ErrorCode::unsupported, file.name + ": " + name +
                                              ": expected even spacing, found irregular; uneven grids "
                                              "cannot be shown");
    const double step = dimension->number("step").value_or(1), start = dimension->number("start").value_or(0);
    std::vector<double> cosines = dimension->numbers("direction_cosines");
    if (cosines.size() != 3) {
      cosines.assign(3, 0);
      cosines[std::size_t(axis)] = 1;
    }
    const glm::dvec3 direction(cosines[0], cosines[1], cosines[2]);
    grid.worldFromVoxel[axis] = glm::dvec4(step * direction, 0);
    origin += start * direction;
  }
  grid.worldFromVoxel[3] = glm::dvec4(origin, 1);
  return grid;
}

std::pair<double, double> mincTypeRange(StoredType type) {
  switch (type) {
    case StoredType::i8:
      return {-128, 127};
    case StoredType::u8:
      return {0, 255};
    case StoredType::i16:
      return {-32768, 32767};
    case StoredType::u16:
      return {0, 65535};
    case StoredType::i32:
      return {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()};
    default:
      return {0, std::numeric_limits<std::uint32_t>::max()};
  }
}

MincScale mincScale(const Hdf5File& file, const ArrayNode& image) {
  const StoredType type = *image.type;
  const ArrayNode* low = file.tree.find(std::string(kMincImage) + "-min");
  const ArrayNode* high = file.tree.find(std::string(kMincImage) + "-max");
  if (type == StoredType::f32 || type == StoredType::f64 || !low || !high) return {};
  const std::string where = file.name + ":" + cleanText(low->path);
  std::uint64_t count = 1;
  for (const std::uint64_t side : low->dims) count = saturatingProduct(count, side);
  const bool leading = low->dims.size() <= image.dims.size() && low->dims == high->dims &&
                       std::equal(low->dims.begin(), low->dims.end(), image.dims.begin());
  if (!leading || low->values.size() != count || high->values.size() != count)
    failBadInput(where +
                 ": expected numbers for the image's slices as in "
                 "image-max, found others");
  MincScale scale{0, 0, low->values, high->values, low->dims};
  std::tie(scale.lowest, scale.highest) = mincTypeRange(type);
  const std::vector<double> valid = image.numbers("valid_range");
  if (valid.size() == 2 && valid[0] < valid[1] && std::isfinite(valid[0]) && std::isfinite(valid[1])) {
    scale.lowest = valid[0];
    scale.highest = valid[1];
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(scale.low[i]) || !std::isfinite(scale.high[i]))
      failBadInput(where + ": expected finite numbers, found others");
  return scale;
}

/// Slope and intercept of slice `i`.
std::pair<double, double> mincSlope(const MincScale& scale, std::size_t i) {
  const double slope = (scale.high[i] - scale.low[i]) / (scale.highest - scale.lowest);
  return {slope, scale.low[i] - slope * scale.lowest};
}

/// Whether all slices have one scale, other than a slope of 0.
bool isOneMincScale(const MincScale& scale) {
  const auto same = [](const std::vector<double>& values) {
    return std::ranges::adjacent_find(values, std::not_equal_to<>()) == values.end();
  };
  return same(scale.low) && same(scale.high) && scale.low[0] != scale.high[0];
}

/// The real values of a box of the slab.
std::vector<float> scaleMinc(const MincScale& scale, const ArraySlab& slab, const ArrayBox& box) {
  // Where in the scales a slice is, by its indices: of x, y and z those of the
  // voxel, of others the slab's.
  std::size_t fixed = 0, each = 1;
  glm::i64vec3 perAxis(0);
  for (std::size_t d = scale.dims.size(); d-- > 0; each *= std::size_t(scale.dims[d])) {
    const auto axis = std::ranges::find(slab.axes, int(d)) - slab.axes.begin();
    if (axis < 3)
      perAxis[int(axis)] = std::int64_t(each);
    else
      fixed += std::size_t(slab.first[d]) * each;
  }
  std::vector<std::pair<double, double>> slopes;
  for (std::size_t i = 0; i < scale.low.size(); ++i) slopes.push_back(mincSlope(scale, i));
  return convertedBox(box, slab.type, [&](double stored, const glm::ivec3& at) {
    const glm::i64vec3 index = glm::i64vec3(at) * perAxis;
    const auto& [slope, intercept] = slopes[fixed + std::size_t(index.x + index.y + index.z)];
    return float(slope * std::clamp(stored, scale.lowest, scale.highest) + intercept);
  });
}

/// Everything that reading needs.
struct MincSource {
  ArrayNode image;
  std::string roles;
  MincScale scale;
  bool perSlice = false;
};

VolumeInfo describeMinc(const Hdf5File& file, const MincSource& source) {
  const std::string where = file.name + ":" + cleanText(source.image.path);
  VolumeInfo volume{.levels = {mincGrid(file, source.image, source.roles)}, .worldUnit = "mm"};
  const std::uint64_t channels = lengthOf(source.image, source.roles, 'c');
  const std::uint64_t times = lengthOf(source.image, source.roles, 't');
  if (channels > 4096 || times > (1 << 24))
    throw Error(ErrorCode::unsupported,
                where + ": expected at most 4096 channels and 2^24 times, found more");
  volume.times.count = std::size_t(times);
  const ArrayNode* time = file.tree.find("/minc-2.0/dimensions/time");
  if (const double step = time ? time->number("step").value_or(NAN) : NAN; times > 1 && std::isfinite(step)) {
    const double start = time->number("start").value_or(0);
    for (std::size_t i = 0; i < times; ++i) volume.times.values.push_back(start + double(i) * step);
    volume.times.unit = time->joined("units");
    if (volume.times.unit.empty()) volume.times.unit = "s";
  }
  ChannelInfo channel{.unit = source.image.joined("units"), .type = *source.image.type};
  if (source.perSlice)
    channel.type = StoredType::f32;
  else if (!source.scale.low.empty())
    std::tie(channel.slope, channel.intercept) = mincSlope(source.scale, 0);
  volume.channels.assign(std::size_t(channels), channel);
  return volume;
}

}  // namespace

std::optional<VolumeFile> openMincLayout(const Hdf5File& file) {
  const ArrayNode* image = file.tree.find(kMincImage);
  if (!image || image->isGroup) return std::nullopt;
  const std::string where = file.name + ":" + cleanText(image->path);
  if (!image->problem.empty()) throw Error(ErrorCode::unsupported, where + " " + image->problem);
  if (!image->type)
    throw Error(ErrorCode::unsupported, where + ": expected real numbers, found another type");
  const auto source = std::make_shared<MincSource>();
  source->image = *image;
  source->roles = mincRoles(where, mincDimensions(where, *image));
  source->scale = mincScale(file, *image);
  source->perSlice = !source->scale.low.empty() && !isOneMincScale(source->scale);
  VolumeFile result{file.path, {describeMinc(file, *source)}};
  result.read = [path = file.path, source](const VolumeInfo& volume, const Part& part, Loading& loading) {
    std::vector<ArraySlab> slabs;
    for (const std::size_t channel : part.channels) {
      ArraySlab slab = slabOf(source->image, source->roles, part.time, channel);
      if (source->perSlice)
        slab.convert = [source, whole = slab](const ArrayBox& box) {
          return scaleMinc(source->scale, whole, box);
        };
      slabs.push_back(std::move(slab));
    }
    return readSlabs(openHdf5Arrays, path, slabs, volume, part, loading);
  };
  return result;
}

VolumeFile openMinc(const std::filesystem::path& path, const OpenOptions& options) {
  return openHdf5(path, options);  // which knows the layout
}
#endif

}  // namespace scolopax::io
