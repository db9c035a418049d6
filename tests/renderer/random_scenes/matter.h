// SPDX-License-Identifier: Apache-2.0
// The matter that directMarch() samples: one channel's field and appearance, and the decisions that led to a
// sample.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/data/scene.h"

namespace scolopax::random_scenes {

/// Hash of the decisions that led to a sample.
class Decisions {
 public:
  void note(std::uint64_t which) { hash_ = (hash_ ^ (which + 1)) * 0x100000001b3u; }
  std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

/// One channel's values and appearance.
struct Matter {
  int number;                  // of the channel
  std::vector<double> values;  // data values, x fastest
  glm::ivec3 dims;
  const ChannelAppearance* look;

  /// A surface: its value, the share of the light that it absorbs, and its colour.
  struct Surface {
    double value, opacity;
    glm::dvec3 color;
  };
  std::vector<Surface> surfaces{};
  double voxel(int i, int j, int k) const { return values[std::size_t(i + dims.x * (j + dims.y * k))]; }
  static double mean(double a, double b, double w) { return w == 1 ? b : a + w * (b - a); }

  /// The position of a coordinate, moved to between the outermost centres: in the cell that begins at voxel
  /// `low`, at the share `way` of its width.
  struct Place {
    int low;
    double way;
  };
  double inside(double x, int axis) const { return std::fmin(std::fmax(x, 0), dims[axis] - 1); }
  Place place(const glm::dvec3& p, int axis) const {
    const double x = inside(p[axis], axis);
    const int low = std::max(0, std::min(int(std::floor(x)), dims[axis] - 2));
    return {low, x - low};
  }

  /// The value at a point; not finite if there is none.
  double at(const glm::dvec3& p, Decisions* decisions) const {
    switch (look->interpolation) {
      case Interpolation::trilinear:
        break;
      case Interpolation::cubic:
        return cubic(p, kNoAxis);
      case Interpolation::nearest:
        return nearest(p, decisions);
    }
    return trilinear(p);
  }

  /// NaN in a cell with a corner that is not finite.
  double trilinear(const glm::dvec3& p) const {
    int low[3], high[3];
    double w[3];
    for (int axis = 0; axis < 3; ++axis) {
      const Place found = place(p, axis);
      low[axis] = found.low;
      high[axis] = std::min(found.low + 1, dims[axis] - 1);
      w[axis] = found.way;
    }
    double plane[2];
    for (int z = 0; z < 2; ++z) {
      const int k = z ? high[2] : low[2];
      double row[2];
      for (int y = 0; y < 2; ++y) {
        const int j = y ? high[1] : low[1];
        const double a = voxel(low[0], j, k), b = voxel(high[0], j, k);
        if (!std::isfinite(a) || !std::isfinite(b)) return std::numeric_limits<double>::quiet_NaN();
        row[y] = mean(a, b, w[0]);
      }
      plane[z] = mean(row[0], row[1], w[1]);
    }
    return mean(plane[0], plane[1], w[2]);
  }

  /// The uniform cubic B-spline with these coefficients, or its slope, at the share `w` of the way from the
  /// second to the third. Computed by de Boor's algorithm, which keeps constants to the last bit.
  static double spline(const double (&c)[4], double w, bool slope) {
    const double a = mean(c[0], c[1], (w + 2) / 3), b = mean(c[1], c[2], (w + 1) / 3);
    const double d = mean(c[2], c[3], w / 3);
    const double before = mean(a, b, (w + 1) / 2), after = mean(b, d, w / 2);
    return slope ? 3 * (after - before) : mean(before, after, w);
  }
  static constexpr int kNoAxis = -1;
  /// The spline over 64 voxels or, given an axis, its derivative along it. NaN in a cell for which one of
  /// them is not finite.
  double cubic(const glm::dvec3& p, int derived) const {
    int index[3][4];
    double w[3];
    for (int axis = 0; axis < 3; ++axis) {
      const Place found = place(p, axis);
      for (int n = 0; n < 4; ++n) index[axis][n] = std::max(0, std::min(found.low + n - 1, dims[axis] - 1));
      w[axis] = found.way;
    }
    double planes[4], rows[4], voxels[4];
    for (int z = 0; z < 4; ++z) {
      for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
          voxels[x] = voxel(index[0][x], index[1][y], index[2][z]);
          if (!std::isfinite(voxels[x])) return std::numeric_limits<double>::quiet_NaN();
        }
        rows[y] = spline(voxels, w[0], derived == 0);
      }
      planes[z] = spline(rows, w[1], derived == 1);
    }
    return spline(planes, w[2], derived == 2);
  }

  double nearest(const glm::dvec3& p, Decisions* decisions) const {
    int index[3];
    for (int axis = 0; axis < 3; ++axis) {
      index[axis] = int(std::floor(inside(p[axis], axis) + 0.5));
      decisions->note(std::uint64_t(index[axis]));
    }
    return voxel(index[0], index[1], index[2]);
  }

  /// Gradient per voxel along each axis; none if a part of it is not finite. The spline has its own; else by
  /// trilinear differences of one voxel.
  std::optional<glm::dvec3> gradient(const glm::dvec3& p) const {
    glm::dvec3 g(0);
    for (int axis = 0; axis < 3; ++axis) {
      if (look->interpolation == Interpolation::cubic) {
        g[axis] = cubic(p, axis);
      } else {
        const double x = inside(p[axis], axis);
        glm::dvec3 before = p, after = p;
        before[axis] = std::fmax(x - 1, 0);
        after[axis] = std::fmin(x + 1, dims[axis] - 1);
        if (before[axis] < after[axis])
          g[axis] = (trilinear(after) - trilinear(before)) / (after[axis] - before[axis]);
      }
      if (!std::isfinite(g[axis])) return std::nullopt;
    }
    return g;
  }

  static double share(double value, double lo, double hi) {
    if (lo == hi) return value < lo ? 0 : 1;
    return std::fmin(std::fmax((value - lo) / (hi - lo), 0), 1);
  }
  double position(double value) const {
    return std::pow(share(value, look->rangeLo, look->rangeHi), look->gamma);
  }

  /// Interpolates `of(knot)` between the last knot at or before `position` and the next one.
  template <class Knots, class Of>
  static auto curve(const Knots& knots, double position, Decisions* decisions, Of of) {
    std::size_t next = 0;
    while (next < knots.size() && knots[next].position <= position) ++next;
    decisions->note(next);
    if (next == 0) return of(knots.front());
    if (next == knots.size()) return of(knots.back());
    const auto &a = knots[next - 1], &b = knots[next];
    return of(a) + (of(b) - of(a)) * ((position - a.position) / (b.position - a.position));
  }

  /// The factor of the opacity at a point; `worldFromGradient` is the grid's.
  double factor(const glm::dvec3& p, const glm::dmat3& worldFromGradient, Decisions* decisions) const {
    if (!look->gradientOpacity) return 1;
    const std::optional<glm::dvec3> perVoxel = gradient(p);
    decisions->note(perVoxel.has_value());
    if (!perVoxel) return 0;
    const glm::dvec3 g = worldFromGradient * *perVoxel;
    // Where the gradient passes through zero, its length has a kink, and the sign of its largest component
    // changes.
    int largest = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (std::abs(g[axis]) > std::abs(g[largest]) * (1 + 1e-9)) largest = axis;  // not by rounding
    decisions->note(std::uint64_t(2 * largest + (g[largest] < 0)));
    const GradientOpacity& by = *look->gradientOpacity;
    const double position = share(glm::length(g), by.rangeLo, by.rangeHi);
    decisions->note(std::uint64_t((position > 0) + (position >= 1)));
    return curve(by.factor, position, decisions, [](const OpacityKnot& k) { return k.value; });
  }

  void findSurfaces(double smallestSpacing) {
    const auto colorAt = [&](double p) {
      Decisions decisions;
      return curve(look->color, p, &decisions, [](const ColorKnot& k) { return k.color; });
    };
    for (const Isovalue& i : look->isovalues)
      surfaces.push_back({i.value, i.opacity, i.color ? *i.color : colorAt(position(i.value))});
    if (look->peaks == Peaks::off || look->rangeLo == look->rangeHi) return;
    // A maximum is a value of the curve over an interval (or at a point), before and behind which the curve
    // is smaller.
    const auto& knots = look->opacity;
    const auto before = [&](double p) {  // limit from the left
      std::size_t next = 0;
      while (next < knots.size() && knots[next].position < p) ++next;
      if (next == knots.size()) return knots.back().value;
      if (next == 0 || knots[next].position == p) return knots[next].value;
      const auto &a = knots[next - 1], &b = knots[next];
      return a.value + (b.value - a.value) * ((p - a.position) / (b.position - a.position));
    };
    const auto behind = [&](double p) {  // and from the right
      Decisions decisions;
      return curve(knots, p, &decisions, [](const OpacityKnot& k) { return k.value; });
    };
    std::vector<double> at;
    for (const OpacityKnot& knot : knots)
      if (at.empty() || at.back() != knot.position) at.push_back(knot.position);
    std::vector<std::pair<double, double>> seen;  // positions and limits, from the left and from the right
    for (const double p : at) {
      seen.emplace_back(p, before(p));
      seen.emplace_back(p, behind(p));
    }
    for (std::size_t i = 0; i < seen.size();) {
      std::size_t j = i;
      while (j + 1 < seen.size() && seen[j + 1].second == seen[i].second) ++j;
      const bool rises = i > 0 && seen[i - 1].second < seen[i].second;
      const bool falls = j + 1 < seen.size() && seen[j + 1].second < seen[i].second;
      const double middle = 0.5 * (seen[i].first + seen[j].first), size = look->rangeHi - look->rangeLo;
      if (rises && falls && middle > 0 && middle < 1)
        surfaces.push_back({look->rangeLo + std::pow(middle, 1 / look->gamma) * size,
                            1 - std::exp(-seen[i].second * look->density * smallestSpacing),
                            colorAt(middle)});
      i = j + 1;
    }
  }
};

}  // namespace scolopax::random_scenes
