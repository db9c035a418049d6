// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/visible_hull.h"

#include <algorithm>
#include <glm/common.hpp>

#include "renderer/data/majorant_grid.h"
#include "renderer/data/transfer_function.h"

namespace scolopax {
namespace {

constexpr int kMostCells = 64;

/// The visible range [first, end) of a row of cells along x; first >= end if there is none.
struct Stretch {
  int first, end;
};

std::vector<Stretch> visibleRows(const MacrocellGrid& cells, const std::vector<kernel::BoundTable>& tables) {
  const int length = cells.cells.x;
  const std::size_t columns = cells.levels.size();
  std::vector<Stretch> rows(std::size_t(cells.cells.y) * std::size_t(cells.cells.z), {length, 0});
  const kernel::LevelInterval* intervals = cells.intervals.data();
  for (Stretch& row : rows) {
    const auto seen = [&](int i) {
      return std::any_of(tables.begin(), tables.end(), [&](const kernel::BoundTable& table) {
        return table.over(intervals[std::size_t(i) * columns + std::size_t(table.column)]) > 0;
      });
    };
    int first = 0, end = length;
    while (first < length && !seen(first)) ++first;
    while (end > first && !seen(end - 1)) --end;
    if (first < end) row = {first, end};
    intervals += std::size_t(length) * columns;
  }
  return rows;
}

/// Voxel coordinate, along an axis, of the face before cell i; the outer faces are those of the box.
float faceAt(int i, int cells, int size, int dims) {
  return i == 0 ? -0.5f : i == cells ? float(dims) - 0.5f : float(i * size);
}

/// The corners of boxes that reach one voxel further than the points, inside the volume's box: the cells
/// bound what eight voxels give, but the spline between them depends on their neighbours, too.
std::vector<glm::vec3> oneVoxelFurther(const std::vector<glm::vec3>& points, glm::ivec3 dims) {
  std::vector<glm::vec3> further;
  for (const glm::vec3& point : points)
    for (const float x : {-1.0f, 1.0f})
      for (const float y : {-1.0f, 1.0f})
        for (const float z : {-1.0f, 1.0f})
          further.push_back(glm::clamp(point + glm::vec3(x, y, z), glm::vec3(-0.5f), glm::vec3(dims) - 0.5f));
  return further;
}

}  // namespace

MacrocellGrid buildCoarseMacrocells(const Volume& volume) {
  const glm::ivec3 dims = volume.grid().dims;
  const int gaps = std::max({dims.x, dims.y, dims.z}) - 1;
  return buildMacrocells(volume, std::max(1, (gaps + kMostCells - 1) / kMostCells));
}

std::vector<glm::vec3> visibleHull(const VolumeFacts& volume, const MacrocellGrid& cells,
                                   std::span<const ChannelAppearance> channels) {
  std::vector<kernel::BoundTable> tables;
  bool splines = false;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!channels[i].visible) continue;
    splines = splines || channels[i].interpolation == Interpolation::cubic;
    const TransferFunction transfer(volume.channels[i], channels[i]);
    if (!transfer.invisible()) tables.push_back(buildBounds(cells.levels[i], transfer, int(i)));
    const Surfaces surfaces(volume.channels[i], channels[i], transfer.origin(),
                            volume.grid.smallestSpacing());
    if (surfaces.any()) tables.push_back(buildPresence(cells.levels[i], surfaces, int(i)));
  }
  if (tables.empty()) return {};
  const std::vector<Stretch> rows = visibleRows(cells, tables);
  const glm::ivec3 count = cells.cells, dims = volume.grid.dims;
  // For every line of cell edges along x, the outermost corners of the rows that meet there.
  std::vector<glm::vec3> points;
  for (int z = 0; z <= count.z; ++z)
    for (int y = 0; y <= count.y; ++y) {
      Stretch line{count.x, 0};
      for (int k = std::max(z - 1, 0); k <= std::min(z, count.z - 1); ++k)
        for (int j = std::max(y - 1, 0); j <= std::min(y, count.y - 1); ++j) {
          const Stretch& row = rows[std::size_t(k) * std::size_t(count.y) + std::size_t(j)];
          line = {std::min(line.first, row.first), std::max(line.end, row.end)};
        }
      if (line.first >= line.end) continue;
      const float py = faceAt(y, count.y, cells.size, dims.y), pz = faceAt(z, count.z, cells.size, dims.z);
      for (const int x : {line.first, line.end})
        points.emplace_back(faceAt(x, count.x, cells.size, dims.x), py, pz);
    }
  return splines ? oneVoxelFurther(points, dims) : points;
}

}  // namespace scolopax
