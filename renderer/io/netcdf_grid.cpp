// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/netcdf_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "renderer/io/array_slabs.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

/// The variable of a dimension's name, in the group of the one that has the
/// dimension or above it.
const ArrayNode* netcdfCoordinate(const ArrayTree& tree, const ArrayNode& variable,
                                  const std::string& dimension) {
  for (std::string group = parentOf(variable.path);; group = parentOf(group)) {
    const ArrayNode* found = tree.find((group == "/" ? "" : group) + "/" + dimension);
    if (found && found->dimNames == std::vector<std::string>{dimension}) return found;
    if (group == "/") return nullptr;
  }
}

bool isNetcdfTimeUnit(const std::string& unit) { return unit.find(" since ") != std::string::npos; }

bool isNetcdfTime(const ArrayTree& tree, const ArrayNode& variable, const std::string& dimension) {
  const ArrayNode* coordinate = netcdfCoordinate(tree, variable, dimension);
  if (coordinate && (coordinate->joined("axis") == "T" || isNetcdfTimeUnit(coordinate->joined("units"))))
    return true;
  const std::string name = lowerCase(dimension);
  return name == "time" || name == "t" || name == "times";
}

/// Coordinates with even steps.
struct NetcdfAxis {
  double first = 0, step = 1;
  std::string unit = {};
};

/// Degrees of longitude and latitude are one unit.
std::string netcdfAxisUnit(std::string unit) {
  if (unit.starts_with("degree")) return "degrees";
  return unit;
}

std::optional<NetcdfAxis> evenNetcdfAxis(const ArrayNode& coordinate) {
  constexpr double kTolerance = 1e-3;  // of a step; coordinates are often float32
  const std::vector<double>& values = coordinate.values;
  if (values.size() < 2) return std::nullopt;
  NetcdfAxis axis{values[0], (values.back() - values[0]) / double(values.size() - 1),
                  netcdfAxisUnit(coordinate.joined("units"))};
  if (!std::isfinite(axis.first) || !std::isfinite(axis.step) || axis.step == 0) return std::nullopt;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(std::abs(values[i] - axis.first - double(i) * axis.step) <= kTolerance * std::abs(axis.step)))
      return std::nullopt;
  if (lowerCase(coordinate.joined("positive")) == "down") {  // depths
    axis.first = -axis.first;
    axis.step = -axis.step;
  }
  return axis;
}

/// WRF tells one distance for all cells, in metres. Staggered dimensions are
/// those of the cells' faces.
std::optional<NetcdfAxis> wrfAxis(const ArrayTree& tree, const std::string& dimension) {
  const ArrayNode* root = tree.find("/");
  const bool isX = dimension.starts_with("west_east"), isY = dimension.starts_with("south_north");
  const auto step = root && (isX || isY) ? root->number(isX ? "DX" : "DY") : std::nullopt;
  if (!step || !std::isfinite(*step) || *step <= 0) return std::nullopt;
  return NetcdfAxis{0, *step, "m"};
}

}  // namespace

std::string netcdfRoles(const ArrayTree& tree, const ArrayNode& variable) {
  const std::size_t rank = variable.dims.size();
  std::string roles(rank, '-'), spatial = "xyz";
  for (std::size_t d = 0; d < rank; ++d)
    if (roles.find('t') == std::string::npos && isNetcdfTime(tree, variable, variable.dimNames[d]))
      roles[d] = 't';
  int others = 0;
  for (std::size_t d = rank; d-- > 0;) {
    if (roles[d] == 't') continue;
    if (!spatial.empty()) {
      roles[d] = spatial[0];
      spatial.erase(0, 1);
    } else if (variable.dims[d] > 1) {
      roles[d] = 'c';
      ++others;
    }
  }
  return spatial.size() > 1 || others > 1 ? "" : roles;
}

NetcdfGrid netcdfGrid(const std::string& where, const ArrayTree& tree, const ArrayNode& variable,
                      const std::string& roles) {
  NetcdfGrid result{{dimsOf(where, variable, roles)}};
  std::array<std::optional<NetcdfAxis>, 3> axes;
  std::array<std::string, 3> names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t d = roles.find("xyz"[axis]);
    if (d == std::string::npos) continue;
    names[axis] = variable.dimNames[d];
    const ArrayNode* coordinate = netcdfCoordinate(tree, variable, names[axis]);
    if (coordinate) axes[axis] = evenNetcdfAxis(*coordinate);
    if (!axes[axis]) axes[axis] = wrfAxis(tree, names[axis]);
    if (!axes[axis]) continue;
    if (result.unit.empty() && axis == 0) result.unit = axes[0]->unit;
    if (axes[axis]->unit != result.unit) axes[axis].reset();
  }
  double sum = 0;
  int known = 0;
  for (const auto& axis : axes) {
    sum += axis ? std::abs(axis->step) : 0;
    known += axis ? 1 : 0;
  }
  const double otherwise = known > 0 ? sum / known : 1;
  std::string uneven;
  for (int i = 0; i < 3; ++i) {
    const auto& axis = axes[std::size_t(i)];
    const std::string& name = names[std::size_t(i)];
    const double step = axis ? axis->step : otherwise;
    const double stagger = name.ends_with("_stag") ? -0.5 * step : 0;
    result.grid.worldFromVoxel[i][i] = step;
    result.grid.worldFromVoxel[3][i] = (axis ? axis->first : 0) + stagger;
    if (!axis && !name.empty() && result.grid.dims[i] > 1) uneven += (uneven.empty() ? "" : ", ") + name;
  }
  if (!uneven.empty())
    result.warning = "no even coordinates along " + uneven + "; voxels are shown one step apart";
  return result;
}

Times netcdfTimes(const ArrayTree& tree, const ArrayNode& variable, const std::string& roles) {
  const std::size_t d = roles.find('t');
  if (d == std::string::npos) return {};
  Times times{.count = std::size_t(variable.dims[d])};
  const std::string& name = variable.dimNames[d];
  const ArrayNode* coordinate = netcdfCoordinate(tree, variable, name);
  for (const ArrayNode& node : tree.nodes)  // WRF's is called XTIME
    if (!coordinate && node.dimNames == std::vector<std::string>{name} &&
        isNetcdfTimeUnit(node.joined("units")))
      coordinate = &node;
  const auto isFinite = [](double value) { return std::isfinite(value); };
  if (!coordinate || coordinate->values.size() != times.count || times.count == 1 ||
      !std::ranges::all_of(coordinate->values, isFinite))
    return times;
  times.values = coordinate->values;
  const std::string unit = coordinate->joined("units");
  times.unit = unit.substr(0, unit.find(" since "));
  return times;
}

}  // namespace scolopax::io
