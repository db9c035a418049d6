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

/// Along an axis, the ends of all boxes, each once and in order.
std::vector<int> vtkCuts(int axis, const glm::ivec3& dims, const std::vector<VtkBox>& boxes) {
  std::vector<int> cuts{0, dims[axis]};
  for (const VtkBox& box : boxes) {
    cuts.push_back(box.first[axis]);
    cuts.push_back(box.first[axis] + box.size[axis]);
  }
  std::ranges::sort(cuts);
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  return cuts;
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
  const auto tooMany = [&] {
    return Error(ErrorCode::unsupported, file + ": expected pieces of a simple arrangement, found " +
                                             std::to_string(boxes.size()) +
                                             " that overlap or differ in size");
  };
  const std::array<std::vector<int>, 3> cuts{vtkCuts(0, dims, boxes), vtkCuts(1, dims, boxes),
                                             vtkCuts(2, dims, boxes)};
  const std::size_t width = cuts[0].size() - 1, height = cuts[1].size() - 1, depth = cuts[2].size() - 1;
  if (saturatingProduct(width * height, depth) > kMostWork) throw tooMany();
  std::vector<bool> covered(width * height * depth);
  std::uint64_t work = 0;
  for (const VtkBox& box : boxes) {
    std::array<std::size_t, 3> begin, end;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto indexOf = [&](int cut) {
        return std::size_t(std::ranges::lower_bound(cuts[axis], cut) - cuts[axis].begin());
      };
      begin[axis] = indexOf(box.first[int(axis)]);
      end[axis] = indexOf(box.first[int(axis)] + box.size[int(axis)]);
    }
    work += (end[0] - begin[0]) * (end[1] - begin[1]) * (end[2] - begin[2]);
    if (work > kMostWork) throw tooMany();
    for (std::size_t z = begin[2]; z < end[2]; ++z) {
      for (std::size_t y = begin[1]; y < end[1]; ++y) {
        const auto row = covered.begin() + std::ptrdiff_t((z * height + y) * width);
        std::fill(row + std::ptrdiff_t(begin[0]), row + std::ptrdiff_t(end[0]), true);
      }
    }
  }
  if (std::ranges::find(covered, false) != covered.end())
    throw Error(ErrorCode::badInput,
                file + ": expected pieces that cover the whole extent, found some of it missing");
}

}  // namespace scolopax::io
