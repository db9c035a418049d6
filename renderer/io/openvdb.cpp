// SPDX-License-Identifier: Apache-2.0
// OpenVDB (openvdb.org): sparse grids, which become dense over the box of their active voxels. OpenVDB itself
// trusts what a file says of sizes, so it runs in a child process.
#include <algorithm>
#include <cstring>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/vdb_tree.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;

Match matchOpenVdb(const FileStart& start) {
  using namespace std::string_view_literals;
  if (start.bytes.starts_with(" BDV\0\0\0\0"sv)) return Match::content;
  return start.hasEnding(".vdb") && !start.folder ? Match::name : Match::no;
}

#if SCOLOPAX_HAS_OPENVDB
namespace {

/// A grid and its name in the file.
struct NamedVdbGrid {
  std::string name;
  VdbGrid grid;
};

/// Grids that share a transform, and the box of all of them.
struct VdbGroup {
  std::vector<NamedVdbGrid> grids;
  glm::ivec3 first{0}, last{0};
  std::vector<std::pair<std::size_t, int>> channels;  ///< index of a grid, and a component of its voxels
};

Error damagedVdb(const fs::path& path) {
  return {ErrorCode::badInput, shown(path) + ": is damaged (OpenVDB found what cannot be)"};
}

ApartLimits vdbLimits(const fs::path& path, std::uint64_t memoryLimitBytes) {
  constexpr std::uint64_t kSlowestBytesPerSecond = 1 << 20, kLeastMemory = std::uint64_t(256) << 20;
  ApartLimits limits;
  limits.memoryBytes = std::max(memoryLimitBytes, kLeastMemory);
  limits.computing = std::chrono::seconds(3);
  std::error_code ignored;
  if (const std::uint64_t size = fs::file_size(path, ignored); !ignored)
    limits.computing += std::chrono::seconds(size / kSlowestBytesPerSecond);
  limits.silence = 2 * limits.computing + std::chrono::seconds(10);  // it is silent while it reads a grid
  return limits;
}

std::vector<NamedVdbGrid> readVdbGrids(const fs::path& path, const OpenOptions& options) {
  std::vector<NamedVdbGrid> grids;
  const auto take = [&](std::span<const std::byte> message) {
    NamedVdbGrid one;
    if (message.size() < sizeof(VdbGrid)) throw damagedVdb(path);
    std::memcpy(&one.grid, message.data(), sizeof(VdbGrid));
    const auto name = message.subspan(sizeof(VdbGrid));
    one.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
    if (one.grid.type < StoredType::i8 || one.grid.type > StoredType::f64 ||
        (one.grid.components != 1 && one.grid.components != 3))
      throw damagedVdb(path);
    grids.push_back(std::move(one));
  };
  runApart(shown(path), vdbLimits(path, defaultMemoryLimitBytes()), options.stop,
           [&](const Sender& sender) { sendVdbGrids(path, sender); }, {take, options.warn});
  if (grids.empty()) throw damagedVdb(path);
  return grids;
}

std::vector<VdbGroup> groupVdbGrids(std::vector<NamedVdbGrid> grids) {
  std::vector<VdbGroup> groups;
  for (NamedVdbGrid& one : grids) {
    auto group = std::ranges::find_if(groups, [&](const VdbGroup& other) {
      return other.grids[0].grid.worldFromIndex == one.grid.worldFromIndex;
    });
    if (group == groups.end())
      group = groups.insert(groups.end(), VdbGroup{{}, one.grid.first, one.grid.last, {}});
    group->first = glm::min(group->first, one.grid.first);
    group->last = glm::max(group->last, one.grid.last);
    for (int component = 0; component < one.grid.components; ++component)
      group->channels.emplace_back(group->grids.size(), component);
    group->grids.push_back(std::move(one));
  }
  return groups;
}

VolumeInfo vdbVolume(const fs::path& path, const VdbGroup& group) {
  const auto side = [&](int axis) { return std::int64_t(group.last[axis]) - group.first[axis] + 1; };
  Grid grid{checkedDims(shown(path) + ": box of active voxels", side(0), side(1), side(2)),
            group.grids[0].grid.worldFromIndex};
  grid.worldFromVoxel[3] = grid.worldFromVoxel * glm::dvec4(glm::dvec3(group.first), 1);
  VolumeInfo volume{.levels = {grid}};
  for (const auto& [index, component] : group.channels) {
    const NamedVdbGrid& one = group.grids[index];
    ChannelInfo channel{.name = one.name, .type = one.grid.type};
    if (one.grid.components == 3) channel.name += std::string(" ") + "xyz"[component];
    volume.channels.push_back(channel);
  }
  return volume;
}

/// Writes what the child sends.
class VdbWriter {
 public:
  VdbWriter(const fs::path& path, const VdbGroup& group, const Part& part, std::vector<std::size_t> grids,
            std::vector<ChannelWriter>& writers)
      : path_(path), group_(group), part_(part), grids_(std::move(grids)), writers_(writers) {}

  void take(std::span<const std::byte> message) {
    while (!message.empty()) {
      VdbRecord record;
      if (message.size() < sizeof(record)) throw damagedVdb(path_);
      std::memcpy(&record, message.data(), sizeof(record));
      message = message.subspan(sizeof(record));
      if (record.bytes > message.size()) throw damagedVdb(path_);
      put(record, message.first(record.bytes));
      message = message.subspan(record.bytes);
    }
  }

 private:
  void put(const VdbRecord& record, std::span<const std::byte> values);
  void fill(ChannelWriter& writer, StoredType type, const std::byte* value);

  const fs::path& path_;
  const VdbGroup& group_;
  const Part& part_;
  std::vector<std::size_t> grids_;  ///< of the group, in the order in which they were asked for
  std::vector<ChannelWriter>& writers_;
};

void VdbWriter::put(const VdbRecord& record, std::span<const std::byte> values) {
  if (record.grid >= grids_.size()) throw damagedVdb(path_);
  const VdbGrid& grid = group_.grids[grids_[record.grid]].grid;
  const bool leaf = record.kind == VdbRecord::Kind::leaf;
  const std::size_t number = sizeBytes(grid.type), voxel = number * std::size_t(grid.components);
  const glm::ivec3 first{record.first[0], record.first[1], record.first[2]},
      size{record.size[0], record.size[1], record.size[2]};
  const glm::i64vec3 at = glm::i64vec3(first) - glm::i64vec3(group_.first);
  constexpr std::int64_t kFarthest = 1 << 30;
  if (record.type != grid.type || record.components != grid.components ||
      values.size() != voxel * (leaf ? 512 : 1) || (leaf && size != glm::ivec3(8)) ||
      glm::any(glm::greaterThan(glm::abs(at), glm::i64vec3(kFarthest))))
    throw damagedVdb(path_);
  const auto step = std::ptrdiff_t(leaf ? voxel : 0);
  for (std::size_t i = 0; i < writers_.size(); ++i) {
    const auto& [index, component] = group_.channels[part_.channels[i]];
    if (index != grids_[record.grid]) continue;
    const std::byte* value = values.data() + std::size_t(component) * number;
    if (record.kind == VdbRecord::Kind::background)
      fill(writers_[i], grid.type, value);
    else
      writers_[i].writeBox(glm::ivec3(at), size, value, {64 * step, 8 * step, step});
  }
}

void VdbWriter::fill(ChannelWriter& writer, StoredType type, const std::byte* value) {
  const auto as = [&]<class T>(T number) {
    std::memcpy(&number, value, sizeof number);
    writer.fill(double(number));
  };
  switch (type) {
    case StoredType::u8:
      return as(std::uint8_t());
    case StoredType::i32:
      return as(std::int32_t());
    case StoredType::i64:
      return as(std::int64_t());
    case StoredType::f32:
      return as(0.0f);
    case StoredType::f64:
      return as(0.0);
    default:
      throw damagedVdb(path_);
  }
}

std::vector<VoxelBuffer> readVdb(const fs::path& path, const VdbGroup& group, const VolumeInfo& volume,
                                 const Part& part, Loading& loading) {
  requireRegularFile(path);
  std::vector<std::size_t> grids;
  std::vector<std::string> names;
  for (const std::size_t channel : part.channels) {
    const std::size_t grid = group.channels[channel].first;
    if (!grids.empty() && grids.back() == grid) continue;
    grids.push_back(grid);
    names.push_back(group.grids[grid].name);
  }
  auto writers = makeWriters(shown(path), volume, part, loading);
  VdbWriter writer(path, group, part, grids, writers);
  // What the channels leave.
  const std::uint64_t needed = memoryBytes(volume, part.level, part.channels),
                      left = loading.memoryLimitBytes() - std::min(needed, loading.memoryLimitBytes());
  runApart(shown(path), vdbLimits(path, left), loading.stop(),
           [&](const Sender& sender) { sendVdbVoxels(path, names, group.first, group.last, sender); },
           {[&](std::span<const std::byte> message) { writer.take(message); },
            [&](const std::string& line) { loading.warn(line); }});
  return takeAll(writers);
}

}  // namespace

VolumeFile openOpenVdb(const fs::path& path, const OpenOptions& options) {
  requireRegularFile(path);
  const auto groups = std::make_shared<std::vector<VdbGroup>>(groupVdbGrids(readVdbGrids(path, options)));
  VolumeFile file{path};
  for (const VdbGroup& group : *groups) {
    file.volumes.push_back(vdbVolume(path, group));
    if (groups->size() > 1) file.volumes.back().path = group.grids[0].name;
  }
  file.read = [path, groups](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readVdb(path, (*groups)[part.volume], volume, part, loading);
  };
  return file;
}
#endif

}  // namespace scolopax::io
