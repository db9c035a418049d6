// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vtk_dataset.h"

#include <algorithm>
#include <array>
#include <glm/vector_relational.hpp>
#include <memory>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"
#include "renderer/io/vtk_axes.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostVtkChannels = 4096, kVtkBytesAtOnce = 1 << 20;

struct VtkFieldPiece {
  VtkBox box;
  std::vector<VtkArray> arrays;  ///< in the order of the first piece
};

/// The arrays on one grid: a volume.
struct VtkField {
  struct Channel {
    std::size_t array, component;
  };
  std::vector<VtkFieldPiece> pieces;
  std::vector<Channel> channels;
};

std::string vtkComponentName(const VtkArray& array, std::size_t component) {
  if (component < array.componentNames.size() && !array.componentNames[component].empty())
    return array.componentNames[component];
  static constexpr std::array kAxes{"X", "Y", "Z"};
  static constexpr std::array kSymmetric{"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
  static constexpr std::array kTensor{"XX", "XY", "XZ", "YX", "YY", "YZ", "ZX", "ZY", "ZZ"};
  if (array.components <= 3) return kAxes[component];
  if (array.components == 6) return kSymmetric[component];
  if (array.components == 9) return kTensor[component];
  return std::to_string(component);
}

std::vector<ChannelInfo> vtkChannels(const std::string& file, const std::vector<VtkArray>& arrays,
                                     VtkField& field) {
  std::vector<ChannelInfo> channels;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    if (arrays[i].components > kMostVtkChannels - channels.size())
      throw Error(ErrorCode::unsupported, file + ": expected at most " + std::to_string(kMostVtkChannels) +
                                              " components in all arrays, found more");
    for (std::size_t c = 0; c < arrays[i].components; ++c) {
      std::string name = arrays[i].name;
      if (arrays[i].components > 1) {
        if (!name.empty()) name += ' ';
        name += vtkComponentName(arrays[i], c);
      }
      channels.push_back({.name = name, .type = arrays[i].type});
      field.channels.push_back({i, c});
    }
  }
  return channels;
}

/// The arrays of a piece in the order of the first one's.
std::vector<VtkArray> vtkArraysInOrderOf(const std::vector<VtkArray>& order,
                                         const std::vector<VtkArray>& arrays) {
  std::vector<VtkArray> result;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i < arrays.size() && arrays[i].name == order[i].name;
    const auto found =
        same ? arrays.begin() + std::ptrdiff_t(i) : std::ranges::find(arrays, order[i].name, &VtkArray::name);
    if (found == arrays.end())
      throw Error(ErrorCode::badInput, order[i].where() + ": expected it in every piece, found one without");
    if (found->type != order[i].type || found->components != order[i].components)
      throw Error(ErrorCode::badInput,
                  order[i].where() + ": expected one type and number of components in all pieces");
    result.push_back(*found);
  }
  return result;
}

void checkVtkExtents(const VtkDataSet& dataSet) {
  const std::string file = shown(dataSet.path);
  const glm::i64vec3 size = dataSet.extent.last - dataSet.extent.first + std::int64_t(1);
  checkedDims(file + ": WholeExtent", size.x, size.y, size.z);
  for (const VtkPiece& piece : dataSet.pieces) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t first = piece.extent.first[axis], last = piece.extent.last[axis];
      if (first >= dataSet.extent.first[axis] && first <= last && last <= dataSet.extent.last[axis]) continue;
      throw Error(ErrorCode::badInput, file + ": Extent: expected indices of " + "xyz"[axis] + " from " +
                                           std::to_string(dataSet.extent.first[axis]) + " to " +
                                           std::to_string(dataSet.extent.last[axis]) + ", found " +
                                           std::to_string(first) + " to " + std::to_string(last));
    }
  }
}

/// The voxels of a piece. Along an axis with a single point there is also a single cell.
VtkBox vtkBox(const VtkDataSet& dataSet, const VtkExtent& extent, bool cells) {
  VtkBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const bool flat = dataSet.extent.first[axis] == dataSet.extent.last[axis];
    box.first[axis] = int(extent.first[axis] - dataSet.extent.first[axis]);
    box.size[axis] = int(extent.last[axis] - extent.first[axis]) + (cells && !flat ? 0 : 1);
  }
  return box;
}

Grid vtkGrid(const VtkDataSet& dataSet, bool cells) {
  Grid grid{vtkBox(dataSet, dataSet.extent, cells).size, dataSet.worldFromIndex};
  glm::dvec3 first(dataSet.extent.first);
  for (int axis = 0; axis < 3; ++axis) {
    const bool flat = dataSet.extent.first[axis] == dataSet.extent.last[axis];
    if (cells && !flat) first[axis] += 0.5;
  }
  grid.worldFromVoxel[3] = dataSet.worldFromIndex * glm::dvec4(first, 1);
  return grid;
}

/// Reads the chosen channels of one array of a piece: writers[i] takes component chosen[i], if there is one.
void readVtkArray(const VtkArray& array, const VtkBox& box,
                  const std::vector<std::optional<std::size_t>>& chosen, std::vector<ChannelWriter>& writers,
                  Loading& loading) {
  const std::size_t number = sizeBytes(array.type), voxel = number * array.components;
  VtkArrayReader reader(array, countOf(box.size) * array.components, &loading);
  const auto width = std::size_t(box.size.x), height = std::size_t(box.size.y);
  const std::size_t atOnce = std::max<std::size_t>(kVtkBytesAtOnce / voxel, 1);
  const std::size_t columns = std::min(width, atOnce),
                    rows = std::clamp<std::size_t>(atOnce / width, 1, height);
  std::vector<std::byte> bytes(columns * rows * voxel);
  glm::ivec3 at(0);  // of the box's voxels
  while (at.z < box.size.z) {
    const glm::ivec3 size(int(std::min(columns, width - std::size_t(at.x))),
                          int(std::min(rows, height - std::size_t(at.y))), 1);
    const std::span<std::byte> some = std::span(bytes).first(countOf(size) * voxel);
    loading.checkStop();
    reader.read(some);
    for (std::size_t i = 0; i < writers.size(); ++i) {
      if (!chosen[i]) continue;
      writers[i].writeBox(box.first + at, size, some.data() + *chosen[i] * number,
                          {std::ptrdiff_t(voxel), std::ptrdiff_t(voxel) * size.x, 0}, reader.bigEndian());
    }
    at.x += size.x;
    if (at.x == box.size.x) at = {0, at.y + size.y, at.z};
    if (at.y == box.size.y) at = {0, 0, at.z + 1};
  }
}

std::vector<VoxelBuffer> readVtkField(const std::string& file, const VtkField& field,
                                      const VolumeInfo& volume, const Part& part, Loading& loading) {
  auto writers = makeWriters(file, volume, part, loading);
  for (const VtkFieldPiece& piece : field.pieces) {
    for (std::size_t array = 0; array < piece.arrays.size(); ++array) {
      std::vector<std::optional<std::size_t>> chosen(writers.size());
      bool any = false;
      for (std::size_t i = 0; i < writers.size(); ++i) {
        const VtkField::Channel& channel = field.channels[part.channels[i]];
        if (channel.array != array) continue;
        chosen[i] = channel.component;
        any = true;
      }
      if (any) readVtkArray(piece.arrays[array], piece.box, chosen, writers, loading);
    }
  }
  return takeAll(writers);
}

/// Adds the volume of points or cells, if they have arrays.
void addVtkField(const VtkDataSet& dataSet, bool cells, VolumeFile& file, std::vector<VtkField>& fields) {
  const std::string name = shown(dataSet.path);
  const auto arraysOf = [&](const VtkPiece& piece) -> const auto& {
    return cells ? piece.cells : piece.points;
  };
  const std::vector<VtkArray>& order = arraysOf(dataSet.pieces[0]);
  if (order.empty()) return;
  VtkField field;
  VolumeInfo volume{.path = cells ? "cells" : "points", .levels = {vtkGrid(dataSet, cells)}};
  volume.channels = vtkChannels(name, order, field);
  std::vector<VtkBox> boxes;
  std::uint64_t inPieces = 0;
  for (const VtkPiece& piece : dataSet.pieces) {
    const VtkBox box = vtkBox(dataSet, piece.extent, cells);
    if (glm::any(glm::lessThan(box.size, glm::ivec3(1)))) continue;  // flat, so without cells
    boxes.push_back(box);
    inPieces = saturatingSum(inPieces, countOf(box.size));
    field.pieces.push_back({box, vtkArraysInOrderOf(order, arraysOf(piece))});
    for (const VtkArray& array : field.pieces.back().arrays)
      checkVtkArrayFits(array, saturatingProduct(countOf(box.size), array.components));
  }
  // Pieces overlap by a few layers of ghost cells; more would be read over and over.
  constexpr std::uint64_t kMostOverlap = 64;
  if (inPieces > saturatingProduct(volume.levels[0].voxelCount(), kMostOverlap))
    throw Error(ErrorCode::unsupported, name + ": expected pieces that overlap little, found " +
                                            std::to_string(inPieces) + " voxels in them for " +
                                            std::to_string(volume.levels[0].voxelCount()));
  checkVtkCover(name, volume.levels[0].dims, boxes);
  file.volumes.push_back(std::move(volume));
  fields.push_back(std::move(field));
}

}  // namespace

VolumeFile vtkVolumes(VtkDataSet dataSet, const OpenOptions& options) {
  const std::string name = shown(dataSet.path);
  std::erase_if(dataSet.pieces, [](const VtkPiece& piece) {  // as writers leave them on idle processes
    return glm::any(glm::lessThan(piece.extent.last, piece.extent.first));
  });
  if (dataSet.pieces.empty()) throw Error(ErrorCode::badInput, name + ": expected a piece, found none");
  checkVtkExtents(dataSet);
  if (!dataSet.pieces[0].coordinates.empty()) dataSet.worldFromIndex = evenVtkAxes(dataSet);
  VolumeFile file{.path = dataSet.path, .dataFiles = dataSet.dataFiles};
  std::vector<VtkField> fields;
  addVtkField(dataSet, false, file, fields);
  addVtkField(dataSet, true, file, fields);
  if (fields.empty())
    throw Error(ErrorCode::unsupported, name + ": expected arrays of numbers on points or cells, found none");
  if (fields.size() == 1) file.volumes[0].path.clear();
  file.read = [name, shared = std::make_shared<const std::vector<VtkField>>(std::move(fields))](
                  const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readVtkField(name, shared->at(part.volume), volume, part, loading);
  };
  if (options.stop.stop_requested()) throw Error(ErrorCode::cancelled, name + ": cancelled");
  return file;
}

}  // namespace scolopax::io
