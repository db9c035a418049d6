// SPDX-License-Identifier: Apache-2.0
// openPMD 1 and 2 (github.com/openPMD/openPMD-standard): HDF5 of simulations.
// Components of mesh records are volumes, iterations are times. Particles are
// left out.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/hdf5.h"
#include "renderer/io/hdf5_library.h"
#include "renderer/io/text.h"

namespace scolopax::io {

Match matchOpenPmd(const FileStart& start) {
  // The attribute of the root group; its end is the text's, not another
  // attribute's.
  const bool named = start.bytes.find("openPMDextension") != std::string::npos;
  return named && isHdf5(start.bytes) ? Match::content : Match::no;
}

#if SCOLOPAX_HAS_HDF5
namespace {

/// A component of a record at one iteration: an array, or a group that gives
/// all voxels one value.
struct PmdStep {
  double iteration = 0, seconds = NAN;
  ArrayNode node = {};  ///< dims and type are also those of a constant component
  std::optional<double> constant = {};
};

/// A component at all of its iterations, and its nodes at one of them, which
/// have the attributes.
struct PmdSeries {
  const ArrayNode* record = nullptr;
  const ArrayNode* component = nullptr;
  std::vector<PmdStep> steps = {};
};

/// Attributes of a record, one entry for each dimension, in the order of the
/// array's dimensions.
struct PmdGrid {
  std::string roles;
  std::vector<double> spacing, offset;
};

template <class T>
std::vector<T> inArrayOrder(const ArrayNode& record, std::vector<T> entries) {
  if (record.joined("dataOrder") == "F") std::ranges::reverse(entries);
  return entries;
}

/// The letters of axisLabels if they are some of x, y and z; otherwise z, y, x
/// or y, x.
std::string pmdRoles(const ArrayNode& record, std::size_t rank) {
  std::vector<std::string> labels;
  if (const ArrayAttribute* found = record.find("axisLabels")) labels = inArrayOrder(record, found->texts);
  std::string roles;
  for (const std::string& label : labels) roles += lowerCase(label);
  std::string sorted = roles;
  std::ranges::sort(sorted);
  const bool known = roles.find_first_not_of("xyz") == std::string::npos &&
                     std::ranges::adjacent_find(sorted) == sorted.end();
  if (known && roles.size() == rank) return roles;
  return rank == 3 ? "zyx" : "yx";
}

PmdGrid pmdGrid(const std::string& where, const ArrayNode& record, std::size_t rank) {
  const std::string geometry = lowerCase(record.text("geometry").value_or("cartesian"));
  if (geometry != "cartesian")
    throw Error(ErrorCode::unsupported, where + ": geometry: expected cartesian, found " +
                                            inQuotes(geometry) + "; curved grids cannot be shown");
  PmdGrid grid{pmdRoles(record, rank), {}, {}};
  const double unit = record.number("gridUnitSI").value_or(1);
  const auto numbers = [&](const char* name, double otherwise, double scale) {
    std::vector<double> values = inArrayOrder(record, record.numbers(name));
    if (values.empty()) values.assign(rank, otherwise);
    if (values.size() != rank || !std::ranges::all_of(values, [](double v) { return std::isfinite(v); }))
      failBadInput(where + ": " + name + ": expected " + std::to_string(rank) + " numbers, found " +
                   std::to_string(values.size()));
    for (double& value : values) value *= scale;
    return values;
  };
  grid.spacing = numbers("gridSpacing", 1, unit);
  grid.offset = numbers("gridGlobalOffset", 0, unit);
  if (!std::ranges::all_of(grid.spacing, [](double v) { return v > 0 && std::isfinite(v); }))
    failBadInput(where +
                 ": gridSpacing times gridUnitSI: expected numbers "
                 "above 0, found others");
  return grid;
}

/// "kg s^-2 A^-1" of the seven powers of SI units.
std::string pmdUnit(const ArrayNode& record) {
  static constexpr const char* kUnits[] = {"m", "kg", "s", "A", "K", "mol", "cd"};
  const std::vector<double> powers = record.numbers("unitDimension");
  if (powers.size() != std::size(kUnits)) return "";
  std::string unit;
  for (std::size_t i = 0; i < powers.size(); ++i) {
    if (powers[i] == 0 || !std::isfinite(powers[i])) continue;
    char power[32] = {};
    std::to_chars(power, power + sizeof(power) - 1, powers[i]);
    unit += (unit.empty() ? "" : " ") + std::string(kUnits[i]);
    if (powers[i] != 1) unit += std::string("^") + power;
  }
  return unit;
}

/// The node as a component; none if it is none.
std::optional<PmdStep> pmdStep(const ArrayNode& node) {
  PmdStep step{.node = node};
  step.node.attributes.clear();
  if (!node.isGroup) return node.type ? std::optional(step) : std::nullopt;
  step.constant = node.number("value");
  for (const double side : node.numbers("shape"))
    step.node.dims.push_back(side >= 1 && side < 1e15 ? std::uint64_t(side) : 0);
  step.node.type = StoredType::f64;
  return step.constant && !step.node.dims.empty() ? std::optional(step) : std::nullopt;
}

/// The components by "RECORD" or "RECORD/COMPONENT". Paths are
/// /data/ITERATION/meshes/RECORD[/COMPONENT].
std::map<std::string, PmdSeries> pmdSeries(const ArrayTree& tree, const std::string& meshes) {
  constexpr std::string_view kData = "/data/";
  std::map<std::string, PmdSeries> all;
  for (const ArrayNode& node : tree.nodes) {
    const std::size_t slash =
        node.path.starts_with(kData) ? node.path.find('/', kData.size()) : std::string::npos;
    if (slash == std::string::npos) continue;
    const auto iteration =
        parseNumber(std::string_view(node.path).substr(kData.size(), slash - kData.size()));
    const std::string prefix = node.path.substr(0, slash + 1) + meshes + "/";
    if (!iteration || !std::isfinite(*iteration) || !node.path.starts_with(prefix)) continue;
    const std::string name = node.path.substr(prefix.size());
    const auto depth = std::ranges::count(name, '/');
    auto step = depth < 2 ? pmdStep(node) : std::nullopt;
    if (!step) continue;
    step->iteration = *iteration;
    if (const ArrayNode* group = tree.find(node.path.substr(0, slash)))
      step->seconds = group->number("time").value_or(NAN) * group->number("timeUnitSI").value_or(1);
    PmdSeries& series = all[name];
    series.component = &node;
    series.record = depth == 1 ? tree.find(parentOf(node.path)) : &node;
    if (!series.record) series.record = &node;
    series.steps.push_back(std::move(*step));
  }
  for (auto& [name, series] : all) std::ranges::sort(series.steps, {}, &PmdStep::iteration);
  return all;
}

Times pmdTimes(const PmdSeries& series) {
  Times times{.count = series.steps.size()};
  if (times.count == 1) return times;
  for (const PmdStep& step : series.steps) times.values.push_back(step.seconds);
  times.unit = "s";
  if (std::ranges::all_of(times.values, [](double v) { return std::isfinite(v); })) return times;
  return {.count = times.count};
}

/// The volume of a component. Throws Error if it cannot be one.
VolumeInfo describePmd(const Hdf5File& file, const std::string& name, const PmdSeries& series) {
  const ArrayNode& first = series.steps[0].node;
  const std::string where = file.name + ":" + cleanText(first.path);
  const std::size_t rank = first.dims.size();
  if (!first.problem.empty()) throw Error(ErrorCode::unsupported, where + " " + first.problem);
  if (rank != 2 && rank != 3)
    throw Error(ErrorCode::unsupported,
                where + ": expected 2 or 3 dimensions, found " + std::to_string(rank));
  for (const PmdStep& step : series.steps)
    if (step.node.dims != first.dims || step.node.type != first.type)
      throw Error(ErrorCode::unsupported, where +
                                              ": expected the same size and type at all iterations, found "
                                              "others at iteration " +
                                              std::to_string(std::llround(step.iteration)));
  const PmdGrid pmd = pmdGrid(where, *series.record, rank);
  std::vector<double> position = inArrayOrder(*series.record, series.component->numbers("position"));
  position.resize(rank, 0);
  Grid grid{dimsOf(where, first, pmd.roles)};
  for (std::size_t d = 0; d < rank; ++d) {
    const int axis = pmd.roles[d] - 'x';
    grid.worldFromVoxel[axis][axis] = pmd.spacing[d];
    // Where in a cell the values lie: staggered components lie on grids of
    // their own.
    const double shift = std::isfinite(position[d]) ? position[d] * pmd.spacing[d] : 0;
    grid.worldFromVoxel[3][axis] = pmd.offset[d] + shift;
  }
  ChannelInfo channel{.name = name, .unit = pmdUnit(*series.record), .type = *first.type};
  const double unit = series.component->number("unitSI").value_or(1);
  if (std::isfinite(unit) && unit != 0)
    channel.slope = unit;
  else
    file.options.warn(where + ": unitSI: expected a number other than 0, found another; taken as 1");
  const std::string path = series.steps.size() == 1 ? first.path : name;
  return {path, {grid}, pmdTimes(series), {channel}, "m"};
}

std::vector<VoxelBuffer> readPmd(const std::filesystem::path& path, const PmdStep& step,
                                 const std::string& roles, const VolumeInfo& volume, const Part& part,
                                 Loading& loading) {
  if (!step.constant)
    return readSlabs(openHdf5Arrays, path, {slabOf(step.node, roles)}, volume, part, loading);
  auto writers = makeWriters(shown(path), volume, part, loading);
  writers.at(0).fill(*step.constant);
  return takeAll(writers);
}

}  // namespace

std::optional<VolumeFile> openPmdLayout(const Hdf5File& file) {
  const ArrayNode* root = file.tree.find("/");
  if (!root || !root->find("openPMD")) return std::nullopt;
  std::string meshes = root->text("meshesPath").value_or("");
  while (meshes.ends_with('/')) meshes.pop_back();
  struct Source {
    std::vector<PmdStep> steps;
    std::string roles;
  };
  const auto sources = std::make_shared<std::vector<Source>>();
  VolumeFile result{file.path};
  std::optional<Error> refused;
  for (const auto& [name, series] : pmdSeries(file.tree, meshes)) {
    try {
      result.volumes.push_back(describePmd(file, name, series));
      sources->push_back({series.steps, pmdRoles(*series.record, series.steps[0].node.dims.size())});
    } catch (const Error& error) {  // the others may be sound
      file.options.warn(error.what());
      refused = error;
    }
  }
  if (result.volumes.empty() && refused) throw *refused;
  if (result.volumes.empty())
    throw Error(ErrorCode::unsupported, file.name + ": expected openPMD meshes, found none");
  result.read = [path = file.path, sources](const VolumeInfo& volume, const Part& part, Loading& loading) {
    const Source& source = sources->at(part.volume);
    return readPmd(path, source.steps.at(part.time), source.roles, volume, part, loading);
  };
  return result;
}

VolumeFile openOpenPmd(const std::filesystem::path& path, const OpenOptions& options) {
  return openHdf5(path, options);  // which knows the layout
}
#endif

}  // namespace scolopax::io
