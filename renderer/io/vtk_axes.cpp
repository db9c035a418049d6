// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vtk_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

std::string shortVtkNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The coordinates along an axis, put together from all pieces.
std::vector<double> vtkCoordinates(const VtkDataSet& dataSet, int axis) {
  constexpr std::uint64_t kMostNumbers = 1 << 26;
  const auto countIn = [&](const VtkExtent& extent) {
    return std::uint64_t(extent.last[axis] - extent.first[axis] + 1);
  };
  const std::string where = shown(dataSet.path) + ": " + "xyz"[axis] + " coordinates";
  std::uint64_t inPieces = 0;
  for (const VtkPiece& piece : dataSet.pieces) {
    checkVtkArrayFits(piece.coordinates[std::size_t(axis)], countIn(piece.extent));
    inPieces += countIn(piece.extent);
  }
  if (inPieces > kMostNumbers)
    throw Error(ErrorCode::unsupported,
                where + ": expected at most 2^26 in all pieces, found " + std::to_string(inPieces));
  // Now the file is known to be long enough for this.
  std::vector<double> all;
  if (inPieces >= countIn(dataSet.extent))
    all.resize(std::size_t(countIn(dataSet.extent)), std::numeric_limits<double>::quiet_NaN());
  for (const VtkPiece& piece : dataSet.pieces) {
    if (all.empty()) break;
    std::ranges::copy(readVtkNumbers(piece.coordinates[std::size_t(axis)], countIn(piece.extent)),
                      all.begin() + (piece.extent.first[axis] - dataSet.extent.first[axis]));
  }
  if (all.empty() || !std::ranges::all_of(all, [](double number) { return std::isfinite(number); }))
    throw Error(ErrorCode::badInput, where + ": expected a finite number for every point");
  return all;
}

/// Step of the axis; 1 for a single coordinate.
double evenVtkStep(const std::string& where, const std::vector<double>& all) {
  if (all.size() == 1) return 1;
  const double step = (all.back() - all.front()) / double(all.size() - 1);
  double smallest = all[1] - all[0], largest = smallest;
  bool even = true;
  for (std::size_t i = 1; i < all.size(); ++i) {
    smallest = std::min(smallest, all[i] - all[i - 1]);
    largest = std::max(largest, all[i] - all[i - 1]);
    even = even && std::abs(all[i] - (all[0] + double(i) * step)) <= kVtkEvenTolerance * std::abs(step);
  }
  if (step == 0 || !std::isfinite(step) || smallest * largest < 0)
    throw Error(ErrorCode::badInput,
                where + ": expected numbers that all increase or all decrease, found steps from " +
                    shortVtkNumber(smallest) + " to " + shortVtkNumber(largest));
  if (!even)
    throw Error(ErrorCode::unsupported, where + ": expected even steps, found steps from " +
                                            shortVtkNumber(smallest) + " to " + shortVtkNumber(largest) +
                                            "; grids with uneven axes cannot be shown yet");
  return step;
}

}  // namespace

glm::dmat4 evenVtkAxes(const VtkDataSet& dataSet) {
  glm::dmat4 m(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> all = vtkCoordinates(dataSet, axis);
    const std::string where = shown(dataSet.path) + ": " + "xyz"[axis] + " coordinates";
    m[axis][axis] = evenVtkStep(where, all);
    m[3][axis] = all[0] - double(dataSet.extent.first[axis]) * m[axis][axis];
  }
  return m;
}

void checkVtkCover(const std::string& file, const glm::ivec3& dims, const std::vector<VtkBox>& boxes) {
  // The ends of all boxes cut the grid into cells that are covered whole or not at all.
  constexpr std::uint64_t kMostWork = 1 << 26;
  std::array<std::vector<int>, 3> cuts;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<int>& ends = cuts[std::size_t(axis)];
    ends = {0, dims[axis]};
    for (const VtkBox& box : boxes) {
      ends.push_back(box.first[axis]);
      ends.push_back(box.first[axis] + box.size[axis]);
    }
    std::ranges::sort(ends);
    ends.erase(std::ranges::unique(ends).begin(), ends.end());
  }
  const glm::ivec3 cells(int(cuts[0].size()) - 1, int(cuts[1].size()) - 1, int(cuts[2].size()) - 1);
  const auto tooMany = [&] {
    return Error(ErrorCode::unsupported, file + ": expected pieces of a simple arrangement, found " +
                                             std::to_string(boxes.size()) +
                                             " that overlap or differ in size");
  };
  const std::uint64_t count =
      saturatingProduct(std::uint64_t(cells.x) * std::uint64_t(cells.y), std::uint64_t(cells.z));
  if (count > kMostWork) throw tooMany();
  std::vector<bool> covered(static_cast<std::size_t>(count));
  std::uint64_t work = 0;
  for (const VtkBox& box : boxes) {
    glm::ivec3 begin, end;
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<int>& ends = cuts[std::size_t(axis)];
      begin[axis] = int(std::ranges::lower_bound(ends, box.first[axis]) - ends.begin());
      end[axis] = int(std::ranges::lower_bound(ends, box.first[axis] + box.size[axis]) - ends.begin());
    }
    work += countOf(end - begin);
    if (work > kMostWork) throw tooMany();
    for (int z = begin.z; z < end.z; ++z) {
      for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x)
          covered[(std::size_t(z) * std::size_t(cells.y) + std::size_t(y)) * std::size_t(cells.x) +
                  std::size_t(x)] = true;
      }
    }
  }
  if (std::ranges::find(covered, false) != covered.end())
    throw Error(ErrorCode::badInput,
                file + ": expected pieces that cover the whole extent, found some of it missing");
}

}  // namespace scolopax::io
