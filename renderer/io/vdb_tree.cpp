// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vdb_tree.h"

#if SCOLOPAX_HAS_OPENVDB

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <span>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/vdb_archive.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kVdbMessageBytes = std::size_t(1) << 20;

/// How the values of a tree are sent: their type and number for each voxel.
template <class Value>
struct VdbValue;
#define SCOLOPAX_VDB_VALUE(VALUE, NUMBER, TYPE, COUNT)    \
  template <>                                             \
  struct VdbValue<VALUE> {                                \
    using Number = NUMBER;                                \
    static constexpr StoredType kType = StoredType::TYPE; \
    static constexpr int kComponents = COUNT;             \
  };
SCOLOPAX_VDB_VALUE(float, float, f32, 1)
SCOLOPAX_VDB_VALUE(double, double, f64, 1)
SCOLOPAX_VDB_VALUE(std::int32_t, std::int32_t, i32, 1)
SCOLOPAX_VDB_VALUE(std::int64_t, std::int64_t, i64, 1)
SCOLOPAX_VDB_VALUE(bool, std::uint8_t, u8, 1)
SCOLOPAX_VDB_VALUE(openvdb::Vec3f, float, f32, 3)
SCOLOPAX_VDB_VALUE(openvdb::Vec3d, double, f64, 3)
SCOLOPAX_VDB_VALUE(openvdb::Vec3i, std::int32_t, i32, 3)
#undef SCOLOPAX_VDB_VALUE

using VdbGridTypes = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid,
                                       openvdb::Int64Grid, openvdb::BoolGrid, openvdb::MaskGrid,
                                       openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;

/// The type of a grid without its tree; false if it is not one of the list.
bool setVdbType(const openvdb::GridBase& grid, VdbGrid& result) {
  bool known = false;
  const auto tryType = [&]<class Grid>(const Grid*) {
    if (grid.type() != Grid::gridType()) return;
    result.type = VdbValue<typename Grid::ValueType>::kType;
    result.components = VdbValue<typename Grid::ValueType>::kComponents;
    known = true;
  };
  [&]<class... Grids>(openvdb::TypeList<Grids...>) {
    (tryType(static_cast<const Grids*>(nullptr)), ...);
  }(VdbGridTypes{});
  return known;
}

/// Packs records into messages of a useful size.
class VdbRecordSender {
 public:
  explicit VdbRecordSender(const Sender& sender) : sender_(sender) {}
  void add(const VdbRecord& record, const void* values) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(record) + record.bytes);
    std::memcpy(&bytes_[at], &record, sizeof(record));
    std::memcpy(&bytes_[at + sizeof(record)], values, record.bytes);
    if (bytes_.size() >= kVdbMessageBytes) flush();
  }
  void flush() {
    if (!bytes_.empty()) sender_.send({bytes_});
    bytes_.clear();
  }

 private:
  const Sender& sender_;
  std::vector<std::byte> bytes_;
};

/// Sends what of a tree lies in the box.
template <class Tree>
void sendVdbTree(const Tree& tree, std::uint32_t index, const openvdb::CoordBBox& box,
                 VdbRecordSender& sender) {
  using Traits = VdbValue<typename Tree::ValueType>;
  using Number = typename Traits::Number;
  constexpr int kPerVoxel = Traits::kComponents;
  using Kind = VdbRecord::Kind;
  std::array<Number, std::size_t(512 * kPerVoxel)> values;
  const auto put = [&](std::size_t voxel, const typename Tree::ValueType& value) {
    if constexpr (kPerVoxel == 1)
      values[voxel] = Number(value);
    else
      for (int c = 0; c < kPerVoxel; ++c) values[voxel * kPerVoxel + std::size_t(c)] = value[c];
  };
  const auto send = [&](Kind kind, const openvdb::CoordBBox& at, std::size_t voxels) {
    const openvdb::Coord size = at.dim();
    sender.add({kind,
                index,
                Traits::kType,
                kPerVoxel,
                {at.min().x(), at.min().y(), at.min().z()},
                {size.x(), size.y(), size.z()},
                voxels * kPerVoxel * sizeof(Number)},
               values.data());
  };
  put(0, tree.background());
  send(Kind::background, box, 1);
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox at = tile.getBoundingBox();
    at.intersect(box);
    if (at.empty() || *tile == tree.background()) continue;
    put(0, *tile);
    send(Kind::constant, at, 1);
  }
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::CoordBBox at = leaf->getNodeBoundingBox();
    if (!at.hasOverlap(box)) continue;
    for (openvdb::Index i = 0; i < 512; ++i) put(i, leaf->getValue(i));
    send(Kind::leaf, at, 512);
  }
}

openvdb::Coord vdbCoord(const glm::ivec3& v) { return {v.x, v.y, v.z}; }

std::string vdbBoxText(const openvdb::CoordBBox& box) {
  std::string text;
  for (const openvdb::Coord& at : {box.min(), box.max()})
    text += (text.empty() ? "" : " to ") + std::to_string(at.x()) + "," + std::to_string(at.y()) + "," +
            std::to_string(at.z());
  return text;
}

/// The box of active voxels: from the header, or, if the program that wrote the file left it out, from the
/// tree. Empty if there are none.
openvdb::CoordBBox vdbBox(VdbArchive& archive, std::size_t index, const openvdb::GridBase& header) {
  using Corner = openvdb::TypedMetadata<openvdb::Vec3i>;
  const auto low = header.getMetadata<Corner>(openvdb::GridBase::META_FILE_BBOX_MIN),
             high = header.getMetadata<Corner>(openvdb::GridBase::META_FILE_BBOX_MAX);
  if (low && high) return {openvdb::Coord(low->value()), openvdb::Coord(high->value())};
  return archive.readGrid(index).evalActiveVoxelBoundingBox();
}

/// Describes a grid. Throws Error(unsupported) if it cannot be shown.
VdbGrid describeVdbGrid(VdbArchive& archive, const std::string& where, std::size_t index) {
  const openvdb::GridBase& header = archive.readHeader(index);
  VdbGrid grid;
  if (!setVdbType(header, grid))
    throw Error(ErrorCode::unsupported,
                where + ": type: expected numbers or vectors of three, found " + inQuotes(header.type()));
  const openvdb::math::Transform& transform = header.transform();
  if (!transform.isLinear())
    throw Error(ErrorCode::unsupported,
                where + ": transform: expected an affine one, found " + inQuotes(transform.mapType()));
  const openvdb::Mat4d matrix = transform.baseMap()->getAffineMap()->getMat4();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      grid.worldFromIndex[i][j] = matrix[i][j];  // OpenVDB multiplies row vectors from the left
      if (!std::isfinite(matrix[i][j]))
        throw Error(ErrorCode::badInput, where + ": transform: expected finite numbers, found others");
    }
  const openvdb::CoordBBox box = vdbBox(archive, index, header);
  if (box.empty()) throw Error(ErrorCode::unsupported, where + ": expected active voxels, found none");
  grid.first = {box.min().x(), box.min().y(), box.min().z()};
  grid.last = {box.max().x(), box.max().y(), box.max().z()};
  return grid;
}

/// Calls `work`, and says what is wrong if the file ends too early.
void noticeVdbEnd(const fs::path& path, const std::function<void()>& work) {
  try {
    work();
  } catch (const std::ios_base::failure&) {
    throw Error(ErrorCode::badInput,
                shown(path) + ": expected the whole of its grids, found the end of the file");
  }
}

}  // namespace

void sendVdbGrids(const fs::path& path, const Sender& sender) {
  std::optional<Error> failed;
  bool sent = false;
  noticeVdbEnd(path, [&] {
    VdbArchive archive(path);
    for (std::size_t i = 0; i < archive.gridCount(); ++i) {
      const std::string name = archive.nameOf(i), where = shown(path) + ": grid " + inQuotes(name);
      try {
        const VdbGrid grid = describeVdbGrid(archive, where, i);
        sender.send({std::as_bytes(std::span(&grid, 1)), std::as_bytes(std::span(name))});
        sent = true;
      } catch (const Error& error) {  // the other grids may do
        if (!failed) failed = error;
        sender.warn(std::string(error.what()) + "; left out");
      }
    }
  });
  if (sent) return;
  if (failed) throw *failed;
  throw Error(ErrorCode::badInput, shown(path) + ": expected a grid, found none");
}

void sendVdbVoxels(const fs::path& path, const std::vector<std::string>& names, const glm::ivec3& first,
                   const glm::ivec3& last, const Sender& sender) {
  const openvdb::CoordBBox box(vdbCoord(first), vdbCoord(last));
  VdbRecordSender records(sender);
  const auto sendOne = [&](const openvdb::GridBase& grid, std::size_t index) {
    const openvdb::CoordBBox active = grid.evalActiveVoxelBoundingBox();
    if (!active.empty() && !box.isInside(active))
      throw Error(ErrorCode::badInput, shown(path) + ": grid " + inQuotes(names[index]) +
                                           ": file_bbox_min, file_bbox_max: expected active voxels in " +
                                           vdbBoxText(box) + ", found " + vdbBoxText(active));
    return grid.apply<VdbGridTypes>(
        [&](const auto& typed) { sendVdbTree(typed.tree(), std::uint32_t(index), box, records); });
  };
  noticeVdbEnd(path, [&] {
    VdbArchive archive(path);
    std::size_t sent = 0;
    for (std::size_t i = 0; i < archive.gridCount(); ++i) {
      const auto name = std::ranges::find(names, archive.nameOf(i));
      if (name != names.end() && sendOne(archive.readGrid(i), std::size_t(name - names.begin()))) ++sent;
    }
    if (sent < names.size())
      throw Error(ErrorCode::badInput, shown(path) + ": expected the same grids as before, found others");
  });
  records.flush();
}

}  // namespace scolopax::io
#endif
