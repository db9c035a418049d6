// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_axes.h"

#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace {

struct LengthUnit {
  std::string_view name, shown;
  double meters;
};
constexpr LengthUnit kNgffUnits[] = {
    {"angstrom", "angstrom", 1e-10},
    {"nanometer", "nm", 1e-9},
    {"micrometer", "um", 1e-6},
    {"millimeter", "mm", 1e-3},
    {"centimeter", "cm", 1e-2},
    {"meter", "m", 1.0},
    {"micron", "um", 1e-6},
    {"nm", "nm", 1e-9},
    {"um", "um", 1e-6},
    {"\xC2\xB5m", "um", 1e-6},
    {"mm", "mm", 1e-3},
    {"cm", "cm", 1e-2},
    {"m", "m", 1.0},
};
constexpr std::pair<std::string_view, std::string_view> kNgffTimeUnits[] = {
    {"second", "s"},   {"millisecond", "ms"}, {"microsecond", "us"}, {"nanosecond", "ns"},
    {"minute", "min"}, {"hour", "h"},         {"day", "d"},
};

}  // namespace

ZarrAxes zarrAxesOf(const std::string& where, const std::vector<NgffAxis>& named, const ZarrArray& array) {
  ZarrAxes axes;
  std::vector<std::size_t> unnamed;
  const auto refuse = [&](std::size_t i) {
    throw Error(ErrorCode::unsupported, where + ": axes: expected t, c, z, y and x, once each, found " +
                                            inQuotes(named[i].name) + " of " +
                                            std::to_string(array.shape[i]));
  };
  const auto put = [&](std::optional<std::size_t>& axis, std::size_t i) {
    if (axis) refuse(i);
    axis = i;
  };
  for (std::size_t i = 0; i < named.size(); ++i) {
    const std::string name = lowerCase(named[i].name);
    const auto space = std::string_view("xyz").find(name);
    if (named[i].type == "time")
      put(axes.time, i);
    else if (named[i].type == "channel")
      put(axes.channel, i);
    else if (name.size() == 1 && space != std::string_view::npos)
      put(axes.space[space], i);
    else if (named[i].type == "space")
      unnamed.push_back(i);
    else if (array.shape[i] != 1)
      refuse(i);
  }
  for (std::size_t space = 0; !unnamed.empty(); ++space) {
    while (space < 3 && axes.space[space]) ++space;
    if (space == 3) refuse(unnamed.back());
    axes.space[space] = unnamed.back();
    unnamed.pop_back();
  }
  return axes;
}

glm::ivec3 zarrDimsOf(const std::string& where, const ZarrArray& array, const ZarrAxes& axes) {
  const auto length = [&](std::size_t i) { return axes.space[i] ? array.shape[*axes.space[i]] : 1; };
  return checkedDims(where + ": shape", length(0), length(1), length(2));
}

std::size_t zarrLengthOf(const std::string& where, const ZarrArray& array, std::optional<std::size_t> axis,
                         std::int64_t most) {
  const std::int64_t length = axis ? array.shape[*axis] : 1;
  if (length > most)
    throw Error(ErrorCode::unsupported, where + ": shape: expected at most " + std::to_string(most) +
                                            " times or channels, found " + std::to_string(length));
  return std::size_t(length);
}

std::pair<std::string, glm::dvec3> ngffWorldUnit(const NgffImage& image, const ZarrAxes& axes,
                                                 const Warn& warn) {
  std::vector<std::string> units;
  std::array<const LengthUnit*, 3> known{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!axes.space[i]) continue;
    units.push_back(image.axes[*axes.space[i]].unit);
    const auto unit = std::ranges::find(kNgffUnits, units.back(), &LengthUnit::name);
    known[i] = unit == std::end(kNgffUnits) ? nullptr : unit;
  }
  glm::dvec3 factors(1);
  if (units.empty()) return {"", factors};
  const LengthUnit* shown = known[axes.space[0] ? 0 : axes.space[1] ? 1 : 2];
  if (std::ranges::all_of(units, [&](const std::string& unit) { return unit == units[0]; }))
    return {shown ? std::string(shown->shown) : units[0], factors};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!axes.space[i]) continue;
    if (!known[i] || !shown) {
      warn(image.where +
           ": axes: expected units of length for all or none, found others, which are left out");
      return {"", glm::dvec3(1)};
    }
    factors[int(i)] = known[i]->meters / shown->meters;
  }
  return {std::string(shown->shown), factors};
}

std::string ngffTimeUnit(const std::string& unit) {
  for (const auto& [name, shown] : kNgffTimeUnits)
    if (unit == name) return std::string(shown);
  return unit;
}

}  // namespace scolopax::io
