// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_volume.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_axes.h"

namespace scolopax::io {
namespace {

constexpr std::int64_t kMostZarrTimes = 1 << 20, kMostZarrChannels = 4096;

/// The grid of a level. Without scales, voxels of the finest level are 1 and the others as much larger as
/// there are fewer; without translations, all levels begin at the same corner.
Grid gridOf(const NgffImage& image, const NgffTransform& transform, const Grid* finest,
            const glm::ivec3& dims, const ZarrAxes& axes, const glm::dvec3& factors) {
  Grid grid{dims};
  for (int i = 0; i < 3; ++i) {
    const auto axis = axes.space[std::size_t(i)];
    double scale = 1, translation = 0;
    if (axis && !transform.scale.empty()) {
      scale = transform.scale[*axis] * factors[i];
      translation = transform.translation[*axis] * factors[i];
    } else if (axis && finest) {
      scale = std::max(1.0, std::round(double(finest->dims[i]) / dims[i]));
    } else if (!axis) {  // a picture: as thick as its pixels are wide
      scale = i > 0 ? std::abs(grid.worldFromVoxel[0][0]) : 1;
    }
    if (!std::isfinite(scale) || scale == 0 || !std::isfinite(translation))
      throw Error(ErrorCode::badInput,
                  image.where + ": coordinateTransformations: expected scales other than 0");
    if (!transform.translated && finest && axis)
      translation = (scale - finest->worldFromVoxel[i][i]) / 2 + finest->worldFromVoxel[3][i];
    grid.worldFromVoxel[i][i] = scale;
    grid.worldFromVoxel[3][i] = translation;
  }
  return grid;
}

Times ngffTimes(const NgffImage& image, const ZarrAxes& axes, std::size_t count) {
  Times times{.count = count};
  const NgffTransform& transform = image.levels[0].transform;
  if (!axes.time || count == 1 || transform.scale.empty()) return times;
  const std::string& unit = image.axes[*axes.time].unit;
  const double step = transform.scale[*axes.time], start = transform.translation[*axes.time];
  if (unit.empty() && step == 1 && start == 0) return times;  // what writers put if they know nothing
  for (std::size_t i = 0; i < count; ++i) times.values.push_back(start + step * double(i));
  times.unit = ngffTimeUnit(unit);
  return times;
}

ZarrArray levelArray(const ZarrStore& store, const NgffImage& image, const NgffLevel& level) {
  const auto node = readZarrNode(store, level.path);
  if (!node || !node->isArray)
    throw Error(ErrorCode::badInput,
                image.where + ": datasets: expected an array " + inQuotes(level.path) + ", found none");
  return zarrArrayOf(*node);
}

/// Metadata whose axes are not those of the arrays, but whose names the arrays' own names contain: takes the
/// arrays' axes, and the scales by name.
NgffImage withAxesOf(const ZarrArray& array, NgffImage image, const Warn& warn) {
  if (image.axes.size() == array.shape.size()) return image;
  const auto refuse = [&] {
    throw Error(ErrorCode::badInput, image.where + ": axes: expected " + std::to_string(array.shape.size()) +
                                         ", as many as the array has, found " +
                                         std::to_string(image.axes.size()));
  };
  std::vector<NgffAxis> axes;
  std::vector<std::optional<std::size_t>> from;
  for (const std::string& name : array.axisNames) {
    const auto at = std::ranges::find(image.axes, name, &NgffAxis::name);
    from.push_back(at == image.axes.end() ? std::nullopt
                                          : std::optional(std::size_t(at - image.axes.begin())));
    const std::string type = name == "t" ? "time" : name == "c" ? "channel" : "";
    axes.push_back(from.back() ? *at : NgffAxis{name, type, ""});
  }
  if (std::ranges::count_if(from, [](const auto& at) { return at.has_value(); }) !=
      std::ptrdiff_t(image.axes.size()))
    refuse();
  warn(image.where + ": axes: expected " + std::to_string(array.shape.size()) +
       ", as many as the array has, found " + std::to_string(image.axes.size()) +
       "; the array's own names of axes are used");
  for (NgffLevel& level : image.levels) {
    if (level.transform.scale.empty()) continue;
    const NgffTransform old = level.transform;
    level.transform.scale.assign(axes.size(), 1.0);
    level.transform.translation.assign(axes.size(), 0.0);
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (!from[i]) continue;
      level.transform.scale[i] = old.scale[*from[i]];
      level.transform.translation[i] = old.translation[*from[i]];
    }
  }
  image.axes = std::move(axes);
  return image;
}

void addChannels(const NgffImage& image, std::size_t count, StoredType type, VolumeInfo& info,
                 const Warn& warn) {
  if (!image.channels.empty() && image.channels.size() != count)
    warn(image.where + ": omero.channels: expected " + std::to_string(count) +
         ", as many as the array has, found " + std::to_string(image.channels.size()));
  for (std::size_t i = 0; i < count; ++i) {
    ChannelInfo channel{.type = type};
    if (i < image.channels.size()) {
      channel.name = image.channels[i].name;
      channel.look = image.channels[i].look;
    }
    info.channels.push_back(channel);
  }
}

}  // namespace

ZarrVolume ngffVolume(const ZarrStore& store, const NgffImage& told, const std::string& path,
                      const OpenOptions& options) {
  ZarrVolume volume{.info = {.path = path}, .levels = {}};
  NgffImage image = told;
  std::pair<std::string, glm::dvec3> unit;
  for (std::size_t i = 0; i < told.levels.size(); ++i) {
    const std::string where = store.shownKey(told.levels[i].path);
    ZarrArray array = levelArray(store, told, told.levels[i]);
    if (i == 0) image = withAxesOf(array, told, options.warn);
    if (array.shape.size() != image.axes.size())
      throw Error(ErrorCode::badInput, where + ": shape: expected " + std::to_string(image.axes.size()) +
                                           " axes, as multiscales tells, found " +
                                           std::to_string(array.shape.size()));
    const ZarrAxes axes = zarrAxesOf(image.where, image.axes, array);
    const std::size_t channels = zarrLengthOf(where, array, axes.channel, kMostZarrChannels),
                      times = zarrLengthOf(where, array, axes.time, kMostZarrTimes);
    const Grid* finest = i > 0 ? volume.info.levels.data() : nullptr;
    if (i == 0) {
      unit = ngffWorldUnit(image, axes, options.warn);
      volume.info.worldUnit = unit.first;
      volume.info.times = ngffTimes(image, axes, times);
      addChannels(image, channels, array.type, volume.info, options.warn);
    } else {
      if (array.type != volume.info.channels[0].type || channels != volume.info.channels.size() ||
          times != volume.info.times.count) {
        options.warn(where +
                     ": expected the type, times and channels of the finest level, found others; the "
                     "level is left out");
        continue;
      }
    }
    volume.info.levels.push_back(
        gridOf(image, image.levels[i].transform, finest, zarrDimsOf(where, array, axes), axes, unit.second));
    volume.levels.push_back({std::move(array), axes});
  }
  return volume;
}

NgffImage plainZarrImage(const ZarrNode& node, const OpenOptions& options) {
  const ZarrArray array = zarrArrayOf(node);
  NgffImage image{.where = node.documentName + "dimension_names", .levels = {{node.path, {}}}};
  for (const std::string& name : array.axisNames) image.axes.push_back({name, ngffAxisType(name), ""});
  const auto isKnown = [&](const NgffAxis& axis) { return !axis.type.empty(); };
  if (!image.axes.empty() && std::ranges::all_of(image.axes, isKnown)) return image;

  const std::size_t count = array.shape.size();
  const bool channel = options.fourthAxis == FourthAxis::channel ||
                       (options.fourthAxis == FourthAxis::automatic && count == 4 && array.shape[0] == 3);
  const std::array<std::string, 5> kOrder{"t",
                                          channel && count == 4 ? "c"
                                          : count == 4          ? "t"
                                                                : "c",
                                          "z", "y", "x"};
  image.axes.assign(count, {});
  for (std::size_t i = 0; i < std::min(count, kOrder.size()); ++i) {
    const std::string& name = kOrder[kOrder.size() - 1 - i];
    image.axes[count - 1 - i] = {name, ngffAxisType(name), ""};
  }
  return image;
}

}  // namespace scolopax::io
