// SPDX-License-Identifier: Apache-2.0
// Imaris 5.5
// (github.com/imaris/ImarisWriter/blob/master/doc/Imaris5FileFormat.pdf): HDF5
// with an array for each level of resolution, time and channel. Arrays are
// padded to whole chunks; attributes tell the sizes.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/hdf5.h"
#include "renderer/io/hdf5_library.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {

Match matchImaris(const FileStart& start) {
  return start.hasEnding(".ims") && isHdf5(start.bytes) ? Match::content : Match::no;
}

#if SCOLOPAX_HAS_HDF5
namespace {

constexpr std::size_t kMostImarisLevels = 64, kMostImarisTimes = 1 << 20, kMostImarisChannels = 4096;

/// Names of the file's two main groups, and finds what is in them.
struct ImarisGroups {
  const ArrayTree& tree;
  std::string data, info;

  explicit ImarisGroups(const ArrayTree& all) : tree(all), data("/DataSet"), info("/DataSetInfo") {
    const ArrayNode* root = tree.find("/");
    if (!root) return;
    if (const std::string name = root->joined("DataSetDirectoryName"); !name.empty()) data = "/" + name;
    if (const std::string name = root->joined("DataSetInfoDirectoryName"); !name.empty()) info = "/" + name;
  }
  std::string channel(std::size_t level, std::size_t time, std::size_t channel) const {
    return data + "/ResolutionLevel " + std::to_string(level) + "/TimePoint " + std::to_string(time) +
           "/Channel " + std::to_string(channel);
  }
  const ArrayNode* array(std::size_t level, std::size_t time, std::size_t index) const {
    return tree.find(channel(level, time, index) + "/Data");
  }
  std::string text(const std::string& group, std::string_view attribute) const {
    const ArrayNode* node = tree.find(info + "/" + group);
    return node ? std::string(trimmed(node->joined(attribute))) : "";
  }
  std::optional<double> number(const std::string& group, std::string_view attribute) const {
    const auto value = parseNumber(text(group, attribute));
    return value && std::isfinite(*value) ? value : std::nullopt;
  }
};

/// The size without padding, by the channel's attributes.
glm::ivec3 imarisSize(const std::string& file, const ImarisGroups& groups, std::size_t level) {
  const std::string path = groups.channel(level, 0, 0), where = file + ":" + cleanText(path);
  const ArrayNode& array = *groups.array(level, 0, 0);
  if (array.dims.size() != 3)
    failBadInput(where + "/Data: expected 3 dimensions, found " + std::to_string(array.dims.size()));
  std::array<std::int64_t, 3> size{};
  const ArrayNode* group = groups.tree.find(path);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = std::string("ImageSize") + "XYZ"[axis];
    const std::uint64_t stored = array.dims[2 - axis];
    const std::string text = group ? group->joined(name) : "";
    const auto value = text.empty() ? std::int64_t(std::min<std::uint64_t>(stored, std::uint64_t(1) << 62))
                                    : parseInteger(trimmed(text));
    if (!value || *value < 1 || std::uint64_t(*value) > stored)
      failBadInput(where + ": " + name + ": expected 1 to " + std::to_string(stored) + ", found " +
                   inQuotes(text));
    size[axis] = *value;
  }
  return checkedDims(where, size[0], size[1], size[2]);
}

/// The grid of a level: all levels fill the same box.
Grid imarisGrid(const Hdf5File& file, const ImarisGroups& groups, std::size_t level) {
  Grid grid{imarisSize(file.name, groups, level)};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string number = std::to_string(axis);
    const auto low = groups.number("Image", std::string("ExtMin") + number);
    const auto high = groups.number("Image", std::string("ExtMax") + number);
    if (!low || !high || !(*high > *low)) {
      if (level == 0)
        file.options.warn(file.name + ": ExtMin" + number + " and ExtMax" + number +
                          ": expected numbers, the second larger; the size of "
                          "voxels is taken as 1");
      continue;
    }
    const double spacing = (*high - *low) / grid.dims[axis];
    grid.worldFromVoxel[axis][axis] = spacing;
    grid.worldFromVoxel[3][axis] = *low + 0.5 * spacing;
  }
  return grid;
}

/// Numbers between spaces.
std::vector<double> imarisNumbers(const std::string& text) {
  std::vector<double> numbers;
  for (const std::string_view word : splitWords(text))
    if (const auto value = parseNumber(word); value && std::isfinite(*value)) numbers.push_back(*value);
  return numbers;
}

ChannelInfo imarisChannel(const ImarisGroups& groups, std::size_t index, StoredType type) {
  const std::string group = std::string("Channel ") + std::to_string(index);
  ChannelInfo channel{.name = groups.text(group, "Name"), .type = type};
  if (channel.name.starts_with("(name not specified)")) channel.name.clear();
  channel.unit = groups.text(group, "Unit");
  const auto color = imarisNumbers(groups.text(group, "Color"));
  if (color.size() == 3 && groups.text(group, "ColorMode") != "TableColor") {
    channel.look.color.emplace();
    for (std::size_t i = 0; i < 3; ++i)
      (*channel.look.color)[i] = std::uint8_t(std::lround(std::clamp(color[i], 0.0, 1.0) * 255));
  }
  const auto range = imarisNumbers(groups.text(group, "ColorRange"));
  if (range.size() == 2) channel.look.window = {range[0], range[1]};
  return channel;
}

/// Seconds since 1970 of "2009-02-25 12:00:00.000".
std::optional<double> imarisSeconds(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0;
  double second = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d %2d:%2d:%lf", &year, &month, &day, &hour, &minute, &second) != 6)
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(unsigned(month)),
                                         std::chrono::day(unsigned(day))};
  if (!date.ok() || !std::isfinite(second)) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return double(days) * 86400 + hour * 3600 + minute * 60 + second;
}

Times imarisTimes(const ImarisGroups& groups, std::size_t count) {
  Times times{.count = count};
  if (count == 1) return times;
  for (std::size_t i = 0; i < count; ++i) {
    const auto seconds =
        imarisSeconds(groups.text("TimeInfo", std::string("TimePoint") + std::to_string(i + 1)));
    if (!seconds) return {.count = count};
    times.values.push_back(*seconds);
  }
  for (std::size_t i = count; i-- > 0;) times.values[i] -= times.values[0];
  times.unit = "s";
  return times;
}

/// How many of 0, 1, ... exist.
template <class Exists>
std::size_t countImaris(std::size_t most, Exists&& exists) {
  std::size_t count = 0;
  while (count < most && exists(count)) ++count;
  return count;
}

std::vector<VoxelBuffer> readImaris(const std::filesystem::path& path, const ArrayTree& tree,
                                    const VolumeInfo& volume, const Part& part, Loading& loading) {
  const ImarisGroups groups(tree);
  const glm::ivec3 size = volume.levels[part.level].dims;
  std::vector<ArraySlab> slabs;
  for (const std::size_t channel : part.channels) {
    const std::string where =
        shown(path) + ":" + cleanText(groups.channel(part.level, part.time, channel)) + "/Data";
    const ArrayNode* array = groups.array(part.level, part.time, channel);
    if (!array) failBadInput(where + ": expected an array, found none");
    if (!array->problem.empty()) throw Error(ErrorCode::unsupported, where + " " + array->problem);
    const StoredType type = volume.channels[channel].type;
    if (array->type != type || array->dims.size() != 3)
      failBadInput(where + ": expected " + std::string(nameOf(type)) +
                   " of 3 dimensions as at the first time and level, found "
                   "another array");
    ArraySlab slab = slabOf(*array, "zyx");
    for (int axis = 0; axis < 3; ++axis) {
      std::uint64_t& count = slab.count[std::size_t(2 - axis)];
      if (count < std::uint64_t(size[axis]))
        failBadInput(where + ": expected at least " + std::to_string(size[axis]) + " voxels, found " +
                     std::to_string(count));
      count = std::uint64_t(size[axis]);
    }
    slabs.push_back(std::move(slab));
  }
  return readSlabs(openHdf5Arrays, path, slabs, volume, part, loading);
}

}  // namespace

std::optional<VolumeFile> openImarisLayout(const Hdf5File& file) {
  const ImarisGroups groups(file.tree);
  if (!groups.array(0, 0, 0)) return std::nullopt;
  const auto count = [&](std::size_t most, auto&& arrayOf) {
    return countImaris(most, [&](std::size_t i) { return arrayOf(i) != nullptr; });
  };
  const std::size_t levels = count(kMostImarisLevels, [&](std::size_t i) { return groups.array(i, 0, 0); });
  const std::size_t times = count(kMostImarisTimes, [&](std::size_t i) { return groups.array(0, i, 0); });
  const std::size_t channels =
      count(kMostImarisChannels, [&](std::size_t i) { return groups.array(0, 0, i); });
  VolumeInfo volume{.times = imarisTimes(groups, times), .worldUnit = groups.text("Image", "Unit")};
  if (volume.worldUnit.empty()) volume.worldUnit = "um";  // as Imaris takes it
  for (std::size_t level = 0; level < levels; ++level)
    volume.levels.push_back(imarisGrid(file, groups, level));
  for (std::size_t i = 0; i < channels; ++i) {
    const ArrayNode& array = *groups.array(0, 0, i);
    const std::string where = file.name + ":" + cleanText(array.path);
    if (!array.problem.empty()) throw Error(ErrorCode::unsupported, where + " " + array.problem);
    if (!array.type) failBadInput(where + ": expected numbers, found another type");
    volume.channels.push_back(imarisChannel(groups, i, *array.type));
  }
  VolumeFile result{file.path, {std::move(volume)}};
  const auto tree = std::make_shared<const ArrayTree>(file.tree);
  result.read = [path = file.path, tree](const VolumeInfo& info, const Part& part, Loading& loading) {
    return readImaris(path, *tree, info, part, loading);
  };
  return result;
}

VolumeFile openImaris(const std::filesystem::path& path, const OpenOptions& options) {
  return openHdf5(path, options);  // which knows the layout
}
#endif

}  // namespace scolopax::io
