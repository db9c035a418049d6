// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/curve.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/kernel/classify.h"
#include "renderer/kernel/lanes.h"

namespace scolopax {
namespace {

constexpr std::size_t kMaxKnots = 4096;  // indices of both curves' knots together fit the buckets' 16 bits

/// For each bucket, the last knot at or before its start, or 0.
template <class PositionOf>
std::vector<std::uint16_t> bucketsOf(std::size_t knots, PositionOf&& positionOf) {
  std::vector<std::uint16_t> buckets;
  std::size_t knot = 0;
  for (int b = 0; b <= kernel::kCurveBuckets; ++b) {
    const float start = float(b) / float(kernel::kCurveBuckets);
    while (knot + 1 < knots && positionOf(knot + 1) <= start) ++knot;
    buckets.push_back(std::uint16_t(knot));
  }
  return buckets;
}

/// Limit of a curve at p from the left; it differs from the value at p where the curve jumps.
template <class Value>
Value valueBefore(const Curve<Value>& curve, float p) {
  const auto at = std::lower_bound(curve.positions.begin(), curve.positions.end(), p);
  const auto i = std::size_t(at - curve.positions.begin());
  if (i == 0) return curve.values.front();
  if (i == curve.positions.size()) return curve.values.back();
  const float t = (p - curve.positions[i - 1]) / (curve.positions[i] - curve.positions[i - 1]);
  return kernel::between(curve.values[i - 1], curve.values[i], t);
}

template <class Knot>
void checkPositions(const std::vector<Knot>& knots, const char* what) {
  if (knots.empty() || knots.size() > kMaxKnots)
    throw Error(ErrorCode::badInput, std::string(what) + ": expected 1 to " + std::to_string(kMaxKnots) +
                                         " points, found " + std::to_string(knots.size()));
  double last = 0;
  for (const Knot& knot : knots) {
    if (!(knot.position >= last && knot.position <= 1))
      throw Error(ErrorCode::badInput, std::string(what) +
                                           ": positions must lie in [0,1] and not decrease, found " +
                                           shortText(knot.position));
    last = knot.position;
  }
}

/// The curve of a checked list of knots; `valueOf` gives the value of each.
template <class Value, class Knot, class ValueOf>
Curve<Value> curveOf(const std::vector<Knot>& knots, ValueOf&& valueOf) {
  Curve<Value> curve;
  for (const Knot& knot : knots) {
    curve.positions.push_back(float(knot.position));
    curve.values.push_back(valueOf(knot));
  }
  curve.buckets = bucketsOf(curve.positions.size(), [&](std::size_t i) { return curve.positions[i]; });
  return curve;
}

}  // namespace

Curve<float> makeCurve(const std::vector<OpacityKnot>& knots, const char* name) {
  checkPositions(knots, name);
  for (const OpacityKnot& knot : knots)
    if (!(knot.value >= 0 && knot.value <= 1))
      throw Error(ErrorCode::badInput,
                  std::string(name) + ": values must lie in [0,1], found " + shortText(knot.value));
  return curveOf<float>(knots, [](const OpacityKnot& knot) { return float(knot.value); });
}

Curve<glm::vec3> makeCurve(const std::vector<ColorKnot>& knots, const char* name) {
  checkPositions(knots, name);
  return curveOf<glm::vec3>(knots, [](const ColorKnot& knot) { return glm::vec3(knot.color); });
}

OpticalCurve makeOpticalCurve(const Curve<float>& opacity, const Curve<glm::vec3>& color) {
  std::vector<float> positions{0.0f, 1.0f};
  positions.insert(positions.end(), opacity.positions.begin(), opacity.positions.end());
  positions.insert(positions.end(), color.positions.begin(), color.positions.end());
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  const auto jumpsAt = [](const auto& curve, float p) {
    const auto [first, last] = std::equal_range(curve.positions.begin(), curve.positions.end(), p);
    return last - first > 1;
  };
  OpticalCurve curve;
  const auto opacityView = opacity.view();
  const auto colorView = color.view();
  for (const float p : positions) {
    const bool jumps = p > 0 && (jumpsAt(opacity, p) || jumpsAt(color, p));
    curve.jumps = curve.jumps || jumps;
    if (jumps) curve.knots.push_back({p, 0, p, valueBefore(opacity, p), valueBefore(color, p)});
    curve.knots.push_back({p, 0, p, kernel::evaluate(opacityView, p), kernel::evaluate(colorView, p)});
  }
  for (std::size_t i = 0; i + 1 < curve.knots.size(); ++i) {
    const float width = curve.knots[i + 1].position - curve.knots[i].position;
    if (width > 0) curve.knots[i].inverseWidth = 1.0f / width;
  }
  curve.buckets = bucketsOf(curve.knots.size(), [&](std::size_t i) { return curve.knots[i].position; });

  const auto opaque = [](const kernel::OpticalKnot& knot) { return knot.opacity > 0; };
  const auto first = std::find_if(curve.knots.begin(), curve.knots.end(), opaque);
  const auto last = std::find_if(curve.knots.rbegin(), curve.knots.rend(), opaque);
  if (first == curve.knots.end()) {
    curve.first = std::numeric_limits<float>::infinity();
    return curve;
  }
  // If the curve jumps up there, the position of the jump itself has opacity.
  curve.first = first == curve.knots.begin() ? -kernel::kInfinity
                : std::prev(first)->position == first->position
                    ? std::nextafter(first->position, -kernel::kInfinity)
                    : std::prev(first)->position;
  curve.last = last == curve.knots.rbegin() ? kernel::kInfinity : std::prev(last)->position;
  return curve;
}

Placement::Placement(double lo, double hi, bool rising) {
  // The origin is a float near the range, and its rounding error goes into the offset: a range of 280 to 310
  // K, or of a few ulp, keeps the full resolution of the voxels.
  constexpr double kLimit = 0x1p126, kFarthest = 1e300;
  lo = std::clamp(lo, -kFarthest, kFarthest);
  hi = std::clamp(hi, -kFarthest, kFarthest);
  origin = float(std::clamp(lo, -kLimit, kLimit));
  if (lo != hi) {
    const double perUnit = 1.0 / (hi - lo);
    scale = float(std::clamp(perUnit, -kLimit, kLimit));
    offset = float((double(origin) - lo) * perUnit);
    return;
  }
  // The origin is the outermost float at which the position is still 1.
  const float infinity = std::numeric_limits<float>::infinity();
  if (rising && double(origin) < lo) origin = std::nextafter(origin, infinity);
  if (!rising && double(origin) > lo) origin = std::nextafter(origin, -infinity);
  scale = rising ? std::numeric_limits<float>::max() : -std::numeric_limits<float>::max();
  offset = 1.0f;
}

}  // namespace scolopax
