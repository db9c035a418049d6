// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/spline_cell.h"

#include <algorithm>
#include <utility>

#include "renderer/reference/lerp.h"

namespace scolopax::reference {
namespace {

using SplineRow = std::array<double, 4>;  // the first `count` of them are used

/// Where de Boor's algorithm divides the control values of a uniform spline of `count` - 1 degrees, for one
/// parameter: the ratios of all levels.
struct Ratios {
  std::array<std::array<double, 3>, 3> of{};
  Ratios(double t, std::size_t count) {
    for (std::size_t level = 1; level < count; ++level)
      for (std::size_t j = 0; j + level < count; ++j)
        of[level - 1][j] = (t + double(count - 1 - level - j)) / double(count - level);
  }
};

/// De Boor's algorithm with one parameter in the first `ends` levels and another in the rest: coefficient
/// `ends`, in Bernstein form, of the part between both parameters (the blossom of the segment). Interpolates
/// only, so that equal control values give their value to the last bit.
double blossom(SplineRow v, std::size_t count, const Ratios& begin, const Ratios& end, std::size_t ends) {
  for (std::size_t level = 1; level < count; ++level) {
    const auto& ratio = (level <= ends ? end : begin).of[level - 1];
    for (std::size_t j = 0; j + level < count; ++j) v[j] = lerpExact(v[j], v[j + 1], ratio[j]);
  }
  return v[0];
}

/// Values on a small grid, x fastest.
struct Box {
  std::array<std::size_t, 3> size{4, 4, 4};
  std::array<double, 64> values{};

  std::size_t count() const { return size[0] * size[1] * size[2]; }
  std::pair<double, double> range() const {
    const auto [least, most] = std::minmax_element(values.begin(), values.begin() + std::ptrdiff_t(count()));
    return {*least, *most};
  }
  /// Replaces every row along an axis by `length` values: rule(row) changes a row.
  template <class Rule>
  void replaceRows(std::size_t axis, std::size_t length, const Rule& rule) {
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? size[0] : size[0] * size[1];
    const std::size_t layers = count() / (stride * size[axis]);
    const Box before = *this;
    size[axis] = length;
    for (std::size_t layer = 0; layer < layers; ++layer)
      for (std::size_t i = 0; i < stride; ++i) {
        SplineRow row{};
        for (std::size_t k = 0; k < before.size[axis]; ++k)
          row[k] = before.values[(layer * before.size[axis] + k) * stride + i];
        rule(row);
        for (std::size_t k = 0; k < length; ++k) values[(layer * length + k) * stride + i] = row[k];
      }
  }
};

/// The derivative along an axis: a spline of one degree less, whose control values are the differences.
Box derivative(Box box, std::size_t axis) {
  box.replaceRows(axis, 3, [](SplineRow& row) {
    for (std::size_t k = 0; k < 3; ++k) row[k] = row[k + 1] - row[k];
  });
  return box;
}

double valueAt(Box box, const glm::dvec3& point) {
  const auto [least, most] = box.range();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t count = box.size[axis];
    const Ratios at(point[int(axis)], count);
    box.replaceRows(axis, 1, [&](SplineRow& row) { row[0] = blossom(row, count, at, at, 0); });
  }
  return std::clamp(box.values[0], least, most);  // rounding must not carry it across a step of a curve
}

/// The spline of these control values from `begin` to `end`. Each axis by itself has Bernstein coefficients;
/// the line is the diagonal of their product.
Bernstein diagonal(Box box, const glm::dvec3& begin, const glm::dvec3& end) {
  const auto [least, most] = box.range();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t count = box.size[axis];
    const Ratios first(begin[int(axis)], count), last(end[int(axis)], count);
    box.replaceRows(axis, count, [&](SplineRow& row) {
      const SplineRow control = row;
      for (std::size_t k = 0; k < count; ++k) row[k] = blossom(control, count, first, last, k);
    });
  }
  const auto [nx, ny, nz] = box.size;
  const std::size_t degree = nx + ny + nz - 3;
  std::array<double, Bernstein::kMaxDegree + 1> b{};
  const double* value = box.values.data();
  for (std::size_t z = 0; z < nz; ++z)
    for (std::size_t y = 0; y < ny; ++y)
      for (std::size_t x = 0; x < nx; ++x)
        b[x + y + z] += binomial(nx - 1, x) * binomial(ny - 1, y) * binomial(nz - 1, z) * *value++;
  for (std::size_t k = 0; k <= degree; ++k) b[k] = std::clamp(b[k] / binomial(degree, k), least, most);
  return Bernstein(std::span(b).first(degree + 1));
}

}  // namespace

double SplineCell::operator()(const glm::dvec3& point) const { return valueAt({.values = voxels_}, point); }

glm::dvec3 SplineCell::gradient(const glm::dvec3& point) const {
  const Box box{.values = voxels_};
  return {valueAt(derivative(box, 0), point), valueAt(derivative(box, 1), point),
          valueAt(derivative(box, 2), point)};
}

Bernstein SplineCell::along(const glm::dvec3& begin, const glm::dvec3& end) const {
  return diagonal({.values = voxels_}, begin, end);
}

BernsteinVector SplineCell::gradientAlong(const glm::dvec3& begin, const glm::dvec3& end) const {
  const Box box{.values = voxels_};
  return {diagonal(derivative(box, 0), begin, end), diagonal(derivative(box, 1), begin, end),
          diagonal(derivative(box, 2), begin, end)};
}

}  // namespace scolopax::reference
