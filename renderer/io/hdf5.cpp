// SPDX-License-Identifier: Apache-2.0
// HDF5 (support.hdfgroup.org/documentation) without a particular layout: every array of numbers that can be a
// volume is one. Axes by the labels of ilastik and of HDF5's dimension scales, voxel sizes as PlantSeg writes
// them.
#include "renderer/io/hdf5.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/hdf5_library.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;

bool isHdf5(std::string_view bytes) {
  for (const std::size_t offset : {0U, 512U, 1024U, 2048U})
    if (bytes.size() > offset && bytes.substr(offset).starts_with("\x89HDF\r\n\x1A\n")) return true;
  return false;
}

Match matchHdf5(const FileStart& start) {
  if (isHdf5(start.bytes)) return Match::content;
  const bool named = start.hasEnding(".h5") || start.hasEnding(".hdf5") || start.hasEnding(".hdf");
  return named && !start.folder ? Match::name : Match::no;
}

#if SCOLOPAX_HAS_HDF5
namespace {

constexpr std::uint64_t kMostHdf5Channels = 4096, kMostHdf5Times = 1 << 24;

/// The letters x, y, z, t and c that the file gives the dimensions, one each; "" if it does not.
std::string statedHdf5Roles(const ArrayNode& node) {
  std::string roles;
  if (const ArrayAttribute* labels = node.find("DIMENSION_LABELS"))
    for (const std::string& label : labels->texts) roles += lowerCase(label.substr(0, 1));
  // ilastik's are JSON: {"axes": [{"key": "z", ...}, ...]}.
  const auto tags = nlohmann::json::parse(node.text("axistags").value_or(""), nullptr, false);
  if (tags.is_object() && tags.contains("axes") && tags["axes"].is_array())
    for (const auto& axis : tags["axes"])
      if (axis.is_object() && axis.contains("key") && axis["key"].is_string())
        roles += axis["key"].get<std::string>();
  std::string sorted = roles;
  std::ranges::sort(sorted);
  const bool once = std::ranges::adjacent_find(sorted) == sorted.end();
  const bool known = roles.find_first_not_of("xyztc") == std::string::npos;
  const bool plane = roles.find('x') != std::string::npos && roles.find('y') != std::string::npos;
  return once && known && plane && roles.size() == node.dims.size() ? roles : "";
}

/// What each dimension is; "" if the array cannot be a volume. docs/files.md states the rule.
std::string hdf5Roles(const ArrayNode& node, FourthAxis fourthAxis) {
  if (std::string stated = statedHdf5Roles(node); !stated.empty()) return stated;
  if (node.dims.size() == 2) return "yx";
  if (node.dims.size() == 3) return "zyx";
  if (node.dims.size() != 4) return "";
  const bool last = node.dims.back() == 3 && node.dims.front() != 3;
  const bool channels = fourthAxis == FourthAxis::channel || (fourthAxis == FourthAxis::automatic &&
                                                              (last ? node.dims.back() : node.dims[0]) == 3);
  if (last) return channels ? "zyxc" : "zyxt";
  return channels ? "czyx" : "tzyx";
}

/// Voxel sizes in the order of the dimensions, and their unit.
struct Hdf5Spacing {
  std::vector<double> sizes = {};
  std::string unit = {};
};

/// What a node itself says of its voxels' sizes.
Hdf5Spacing hdf5SpacingAt(const ArrayNode& node) {
  static constexpr std::pair<const char*, const char*> kNames[] = {{"element_size_um", "um"},
                                                                   {"voxel_size_um", "um"},
                                                                   {"voxel_size", ""},
                                                                   {"resolution", ""},
                                                                   {"spacing", ""}};
  for (const auto& [name, unit] : kNames) {
    std::vector<double> sizes = node.numbers(name);
    const bool good = std::ranges::all_of(sizes, [](double v) { return std::isfinite(v) && v > 0; });
    if (sizes.size() >= 2 && good) return {std::move(sizes), unit};
  }
  return {};
}

/// Voxel sizes of all arrays that tell them, by group and dims, and of groups.
class Hdf5Spacings {
 public:
  explicit Hdf5Spacings(const ArrayTree& tree) {
    for (const ArrayNode& node : tree.nodes) {
      Hdf5Spacing spacing = hdf5SpacingAt(node);
      if (!spacing.sizes.empty())
        known_.emplace(node.isGroup ? Key(node.path, {}) : Key(parentOf(node.path), node.dims), spacing);
    }
  }
  /// That of the array, else of an array of the same size in its group (a label map's image), else of the
  /// group.
  Hdf5Spacing of(const ArrayNode& node) const {
    Hdf5Spacing spacing = hdf5SpacingAt(node);
    const std::string group = parentOf(node.path);
    for (const Key& key : {Key(group, node.dims), Key(group, {})})
      if (const auto found = known_.find(key); spacing.sizes.empty() && found != known_.end())
        spacing = found->second;
    return spacing;
  }

 private:
  using Key = std::pair<std::string, std::vector<std::uint64_t>>;
  std::map<Key, Hdf5Spacing> known_;
};

/// The sizes are those of all dimensions, or of the spatial ones alone.
glm::dvec3 hdf5SpacingAlong(std::string_view roles, const std::vector<double>& sizes) {
  std::string axes(roles);
  if (sizes.size() != axes.size()) std::erase_if(axes, [](char role) { return role == 't' || role == 'c'; });
  glm::dvec3 spacing(1);
  // A plane may have the size of its slice first.
  if (sizes.size() == 3 && axes.size() == 2) axes.insert(0, "z");
  if (sizes.size() != axes.size()) return spacing;
  for (std::size_t d = 0; d < axes.size(); ++d) {
    const std::size_t axis = std::string_view("xyz").find(axes[d]);
    if (axis != std::string_view::npos) spacing[int(axis)] = sizes[d];
  }
  return spacing;
}

bool isHdf5LabelMap(const ArrayNode& node) {
  const std::string name = lowerCase(lastOf(node.path));
  const bool integer = node.type != StoredType::f32 && node.type != StoredType::f64;
  return integer && (name == "label" || name == "labels" || name == "segmentation");
}

VolumeInfo describeHdf5(const Hdf5File& file, const ArrayNode& node, const std::string& roles,
                        const Hdf5Spacing& spacing) {
  const std::string where = file.name + ":" + cleanText(node.path);
  VolumeInfo volume{.path = node.path};
  Grid grid{dimsOf(where, node, roles)};
  const glm::dvec3 sizes = hdf5SpacingAlong(roles, spacing.sizes);
  for (int axis = 0; axis < 3; ++axis) grid.worldFromVoxel[axis][axis] = sizes[axis];
  volume.levels = {grid};
  volume.worldUnit = spacing.unit;
  const std::uint64_t channels = lengthOf(node, roles, 'c'), times = lengthOf(node, roles, 't');
  if (channels > kMostHdf5Channels || times > kMostHdf5Times)
    throw Error(ErrorCode::unsupported, where + ": expected at most " + std::to_string(kMostHdf5Channels) +
                                            " channels and " + std::to_string(kMostHdf5Times) +
                                            " times, found " + std::to_string(channels) + " and " +
                                            std::to_string(times));
  volume.times.count = std::size_t(times);
  ChannelInfo channel{.type = *node.type};
  channel.look.labels = isHdf5LabelMap(node);
  volume.channels.assign(std::size_t(channels), channel);
  return volume;
}

/// An array that is a volume.
struct Hdf5Source {
  ArrayNode node;
  std::string roles;
};

/// The volumes of a file, and why arrays are none.
class Hdf5Volumes {
 public:
  explicit Hdf5Volumes(const Hdf5File& file) : file_(file), spacings_(file.tree) {
    // Planes last: the first volume is the one that is shown.
    for (const bool planes : {false, true})
      for (const ArrayNode& node : file.tree.nodes)
        if (!node.isGroup && (node.dims.size() == 2) == planes) add(node);
    if (volumes.empty() && !refused_.empty()) throw refused_[0];
    if (volumes.empty())
      throw Error(ErrorCode::unsupported,
                  file.name + ": expected an array of numbers of 2 to 4 dimensions, found none");
    for (const Error& error : refused_) file.options.warn(error.what());
  }

  std::vector<VolumeInfo> volumes;
  std::vector<Hdf5Source> sources;

 private:
  void add(const ArrayNode& node) {
    constexpr std::size_t kMostVolumes = 4096, kMostRefused = 16;
    const bool empty = std::ranges::find(node.dims, 0U) != node.dims.end();
    const std::string roles = node.type && !empty ? hdf5Roles(node, file_.options.fourthAxis) : "";
    try {
      const std::string where = file_.name + ":" + cleanText(node.path);
      if (!node.problem.empty() && node.dims.size() != 1)
        throw Error(ErrorCode::unsupported, where + " " + node.problem);
      if (roles.empty() || !node.problem.empty()) return;
      if (volumes.size() == kMostVolumes)
        throw Error(ErrorCode::tooLarge, where + ": is left out, as are all after the first 4096 arrays");
      volumes.push_back(describeHdf5(file_, node, roles, spacings_.of(node)));
      sources.push_back({node, roles});
      sources.back().node.attributes.clear();
    } catch (const Error& error) {  // the others may be sound
      if (refused_.size() < kMostRefused) refused_.push_back(error);
    }
  }

  const Hdf5File& file_;
  Hdf5Spacings spacings_;
  std::vector<Error> refused_;
};

VolumeFile openPlainHdf5(const Hdf5File& file) {
  Hdf5Volumes found(file);
  VolumeFile result{file.path};
  result.volumes = std::move(found.volumes);
  if (result.volumes.size() == 1 && result.volumes[0].channels.size() == 1)
    result.volumes[0].channels[0].name = stemOf(file.path);
  const auto sources = std::make_shared<const std::vector<Hdf5Source>>(std::move(found.sources));
  result.read = [path = file.path, sources](const VolumeInfo& volume, const Part& part, Loading& loading) {
    const Hdf5Source& source = sources->at(part.volume);
    std::vector<ArraySlab> slabs;
    for (const std::size_t channel : part.channels)
      slabs.push_back(slabOf(source.node, source.roles, part.time, channel));
    return readSlabs(openHdf5Arrays, path, slabs, volume, part, loading);
  };
  return result;
}

}  // namespace

VolumeFile openHdf5(const fs::path& path, const OpenOptions& options) {
  requireRegularFile(path);
  const auto scan = [&](const Sender& sender) { scanHdf5(path, sender); };
  constexpr std::chrono::seconds kComputing(30);  // Imaris files may have a hundred thousand arrays
  const Hdf5File file{path, shown(path), scanApart(path, kComputing, options.warn, options.stop, scan),
                      options};
  for (const auto& openLayout : {openImarisLayout, openPmdLayout, openMincLayout})
    if (auto volumes = openLayout(file)) return std::move(*volumes);
  return openPlainHdf5(file);
}
#endif

}  // namespace scolopax::io
