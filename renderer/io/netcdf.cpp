// SPDX-License-Identifier: Apache-2.0
// NetCDF (docs.unidata.ucar.edu/nug), classic and 4: variables of three
// dimensions beside the times are volumes; those of two if there are no others.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/hdf5.h"
#include "renderer/io/netcdf_grid.h"
#include "renderer/io/netcdf_library.h"
#include "renderer/io/text.h"

namespace scolopax::io {

Match matchNetcdf(const FileStart& start) {
  for (const char* magic : {"CDF\x01", "CDF\x02", "CDF\x05"})
    if (start.bytes.starts_with(magic)) return Match::content;
  const bool named = start.hasEnding(".nc") || start.hasEnding(".nc4") || start.hasEnding(".cdf");
  const bool marked = start.bytes.find("_NCProperties") != std::string::npos;
  if (isHdf5(start.bytes) && (named || marked)) return Match::content;
  return named && !start.folder ? Match::name : Match::no;
}

#if SCOLOPAX_HAS_NETCDF
namespace {

constexpr std::uint64_t kMostNetcdfChannels = 4096, kMostNetcdfTimes = 1 << 24;

/// A variable that is a volume.
struct NetcdfSource {
  ArrayNode node;
  std::string roles;
  std::vector<double> missing;  ///< stored numbers that stand for no value
};

bool isNetcdfFloat(StoredType type) { return type == StoredType::f32 || type == StoredType::f64; }

std::vector<double> netcdfMissing(const ArrayNode& node) {
  std::vector<double> missing = node.numbers("_FillValue");
  // What the library fills unwritten floats with, if the file says nothing.
  if (missing.empty() && isNetcdfFloat(*node.type)) missing = {9.9692099683868690e+36};
  std::ranges::copy(node.numbers("missing_value"), std::back_inserter(missing));
  return missing;
}

/// Slope and intercept, if both are usable.
std::pair<double, double> netcdfScale(const ArrayNode& node) {
  const double slope = node.number("scale_factor").value_or(1),
               intercept = node.number("add_offset").value_or(0);
  if (!std::isfinite(slope) || slope == 0 || !std::isfinite(intercept)) return {1, 0};
  return {slope, intercept};
}

VolumeInfo describeNetcdf(const std::string& file, const ArrayTree& tree, const NetcdfSource& source,
                          const Warn& warn) {
  const ArrayNode& node = source.node;
  const std::string where = file + ":" + cleanText(node.path);
  const NetcdfGrid grid = netcdfGrid(where, tree, node, source.roles);
  const std::uint64_t channels = lengthOf(node, source.roles, 'c'), times = lengthOf(node, source.roles, 't');
  if (channels > kMostNetcdfChannels || times > kMostNetcdfTimes)
    throw Error(ErrorCode::unsupported,
                where + ": expected at most 4096 channels and 2^24 times, found more");
  if (!grid.warning.empty()) warn(file + ": " + cleanText(grid.warning));
  VolumeInfo volume{.path = node.path,
                    .levels = {grid.grid},
                    .times = netcdfTimes(tree, node, source.roles),
                    .worldUnit = grid.unit};
  ChannelInfo channel{.unit = node.joined("units"), .type = *node.type};
  if (!source.missing.empty()) channel.type = StoredType::f32;  // with NaN
  std::tie(channel.slope, channel.intercept) = netcdfScale(node);
  volume.channels.assign(std::size_t(channels), channel);
  return volume;
}

/// The variables with so many spatial dimensions.
std::vector<NetcdfSource> netcdfSources(const ArrayTree& tree, std::size_t dimensions) {
  std::vector<std::string> bounds;
  for (const ArrayNode& node : tree.nodes)
    if (const std::string name = node.joined("bounds"); !name.empty()) bounds.push_back(name);
  std::vector<NetcdfSource> sources;
  for (const ArrayNode& node : tree.nodes) {
    const bool empty = std::ranges::find(node.dims, 0U) != node.dims.end();
    if (node.isGroup || !node.type || !node.problem.empty() || empty) continue;
    if (std::ranges::find(bounds, lastOf(node.path)) != bounds.end()) continue;
    const std::string roles = netcdfRoles(tree, node);
    const auto spatial = std::ranges::count_if(roles, [](char c) { return c >= 'x' && c <= 'z'; });
    if (std::size_t(spatial) != dimensions) continue;
    sources.push_back({node, roles, netcdfMissing(node)});
    sources.back().node.values.clear();
  }
  return sources;
}

std::vector<float> withoutNetcdfMissing(const ArrayBox& box, StoredType type,
                                        const std::vector<double>& missing) {
  // Attributes may be double where the numbers are float.
  std::vector<double> values = missing;
  if (type == StoredType::f32)
    for (double& value : values) value = double(float(value));
  return convertedBox(box, type, [&](double number, const glm::ivec3&) {
    const bool none = std::ranges::find(values, number) != values.end();
    return none ? std::numeric_limits<float>::quiet_NaN() : float(number);
  });
}

std::vector<VoxelBuffer> readNetcdf(const std::filesystem::path& path, const NetcdfSource& source,
                                    const VolumeInfo& volume, const Part& part, Loading& loading) {
  std::vector<ArraySlab> slabs;
  for (const std::size_t channel : part.channels) {
    ArraySlab slab = slabOf(source.node, source.roles, part.time, channel);
    if (!source.missing.empty())
      slab.convert = [&source, type = slab.type](const ArrayBox& box) {
        return withoutNetcdfMissing(box, type, source.missing);
      };
    slabs.push_back(std::move(slab));
  }
  return readSlabs(openNetcdfArrays, path, slabs, volume, part, loading);
}

}  // namespace

VolumeFile openNetcdf(const std::filesystem::path& path, const OpenOptions& options) {
  constexpr std::size_t kMostVolumes = 4096;
  requireRegularFile(path);
  const std::string file = shown(path);
  constexpr std::chrono::seconds kComputing(4);  // the library never ends on some damaged files
  const auto scan = [&](const Sender& sender) { scanNetcdf(path, sender); };
  const ArrayTree tree = scanApart(path, kComputing, options.warn, options.stop, scan);
  const auto sources = std::make_shared<std::vector<NetcdfSource>>(netcdfSources(tree, 3));
  if (sources->empty()) *sources = netcdfSources(tree, 2);
  if (sources->empty())
    throw Error(ErrorCode::unsupported, file +
                                            ": expected a variable of numbers with 2 or 3 "
                                            "dimensions beside the time, found none");
  if (sources->size() > kMostVolumes) {
    options.warn(file + ": the variables after the first 4096 are left out");
    sources->resize(kMostVolumes);
  }
  VolumeFile result{path};
  std::set<std::string> warnings;  // most variables share their axes
  const Warn warn = [&](const std::string& line) { warnings.insert(line); };
  for (const NetcdfSource& source : *sources)
    result.volumes.push_back(describeNetcdf(file, tree, source, warn));
  std::ranges::for_each(warnings, options.warn);
  result.read = [path, sources](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readNetcdf(path, sources->at(part.volume), volume, part, loading);
  };
  return result;
}
#endif

}  // namespace scolopax::io
