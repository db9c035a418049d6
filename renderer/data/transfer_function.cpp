// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/kernel/classify.h"

namespace scolopax {
namespace {

constexpr std::size_t kMaxKnots = 4096;  // indices, of both curves together, fit the buckets' 16 bits

/// Last knot at or before each bucket's start, or 0.
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
template <class Value>
void fillBuckets(Curve<Value>& curve) {
  curve.buckets = bucketsOf(curve.positions.size(), [&](std::size_t i) { return curve.positions[i]; });
}

/// Value of a curve to the left of p: it differs from that at p where a curve jumps.
template <class Value>
Value valueBefore(const Curve<Value>& curve, float p) {
  const auto at = std::lower_bound(curve.positions.begin(), curve.positions.end(), p);
  const auto i = std::size_t(at - curve.positions.begin());
  if (i == 0) return curve.values.front();
  if (i == curve.positions.size()) return curve.values.back();
  const float t = (p - curve.positions[i - 1]) / (curve.positions[i] - curve.positions[i - 1]);
  return kernel::between(curve.values[i - 1], curve.values[i], t);
}

OpticalCurve opticalCurve(const Curve<float>& opacity, const Curve<glm::vec3>& color) {
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
    if (p > 0 && (jumpsAt(opacity, p) || jumpsAt(color, p)))
      curve.knots.push_back({p, 0, valueBefore(opacity, p), valueBefore(color, p)});
    curve.knots.push_back({p, 0, kernel::evaluate(opacityView, p), kernel::evaluate(colorView, p)});
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
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  // Where the curve jumps up the position of the jump itself is opaque.
  curve.first = first == curve.knots.begin()                    ? -kInfinity
                : std::prev(first)->position == first->position ? std::nextafter(first->position, -kInfinity)
                                                                : std::prev(first)->position;
  curve.last = last == curve.knots.rbegin() ? kInfinity : std::prev(last)->position;
  return curve;
}

template <class Knot>
void checkPositions(const std::vector<Knot>& knots, const char* what) {
  if (knots.empty() || knots.size() > kMaxKnots)
    throw Error(ErrorCode::badInput, std::string(what) + ": from 1 to " + std::to_string(kMaxKnots) +
                                         " points are possible, found " + std::to_string(knots.size()));
  double last = 0;
  for (const Knot& knot : knots) {
    if (!(knot.position >= last && knot.position <= 1))
      throw Error(ErrorCode::badInput, std::string(what) +
                                           ": positions must lie in [0,1] and not decrease, found " +
                                           shortText(knot.position));
    last = knot.position;
  }
}

}  // namespace

TransferFunction::TransferFunction(const Channel& channel, const ChannelAppearance& a)
    : gamma_(float(a.gamma)),
      density_(float(std::min(a.density, 1e30))),
      weight_(float(a.weight)),
      material_{float(a.material.ambient), float(a.material.diffuse), float(a.material.specular),
                float(a.material.shininess)} {
  checkPositions(a.opacity, "opacity");
  checkPositions(a.color, "colormap");
  if (!(a.gamma > 0) || !(a.density >= 0) || !std::isfinite(a.rangeLo) || !std::isfinite(a.rangeHi))
    throw Error(ErrorCode::badInput,
                "channel '" + channel.name + "': gamma must be above 0, density not negative, range finite");
  const Material& m = a.material;
  if (!(a.weight >= 0) || !(m.ambient >= 0) || !(m.diffuse >= 0) || !(m.specular >= 0) || !(m.shininess > 0))
    throw Error(ErrorCode::badInput, "channel '" + channel.name +
                                         "': weight and material must not be negative, shininess above 0");
  for (const OpacityKnot& knot : a.opacity) {
    if (!(knot.value >= 0 && knot.value <= 1))
      throw Error(ErrorCode::badInput, "opacity: values must lie in [0,1], found " + shortText(knot.value));
    opacity_.positions.push_back(float(knot.position));
    opacity_.values.push_back(float(knot.value));
  }
  for (const ColorKnot& knot : a.color) {
    color_.positions.push_back(float(knot.position));
    color_.values.push_back(glm::vec3(knot.color));
  }
  fillBuckets(opacity_);
  fillBuckets(color_);
  optical_ = opticalCurve(opacity_, color_);

  // Range in stored values. The origin is a float near the range, what rounding it loses goes to the offset:
  // 280 to 310 K, or a spread of a few ulp, keep all the resolution that the voxels have.
  const double lo = (a.rangeLo - channel.intercept) / channel.slope;
  const double hi = (a.rangeHi - channel.intercept) / channel.slope;
  constexpr double kLimit = 0x1p126;
  origin_ = float(std::clamp(lo, -kLimit, kLimit));
  inverseRange_ = float(1.0 / std::abs(hi - lo));
  if (lo == hi) {  // or the ends differ by less than slope and intercept can tell
    // A step: 0 below, 1 from lo on. The origin is the last float at which the position may still be 1.
    const float infinity = std::numeric_limits<float>::infinity();
    const bool rising = (channel.slope > 0) == (a.rangeLo <= a.rangeHi);
    if (rising && double(origin_) < lo) origin_ = std::nextafter(origin_, infinity);
    if (!rising && double(origin_) > lo) origin_ = std::nextafter(origin_, -infinity);
    scale_ = rising ? std::numeric_limits<float>::max() : -std::numeric_limits<float>::max();
    offset_ = 1.0f;
  } else {
    const double scale = 1.0 / (hi - lo);
    scale_ = float(std::clamp(scale, -kLimit, kLimit));
    offset_ = float((double(origin_) - lo) * scale);
  }
}

kernel::ChannelView TransferFunction::view(const Channel& channel) const {
  kernel::ChannelView view{};
  view.voxels = channel.voxels.base();
  view.lane = int(channel.voxels.lane());
  view.stride = int(channel.voxels.stride());
  view.type = channel.voxels.type();
  view.origin = origin_;
  view.scale = scale_;
  view.offset = offset_;
  view.gamma = gamma_;
  view.density = density_;
  view.weight = weight_;
  view.material = material_;
  view.inverseRange = inverseRange_;
  view.finite = channel.histogram.nonFiniteCount == 0;
  view.opacity = opacity_.view();
  view.color = color_.view();
  view.optical = optical_.view();
  return view;
}

float TransferFunction::majorant(ValueInterval interval) const {
  if (!(interval.lo <= interval.hi)) return 0.0f;
  kernel::ChannelView channel{};
  channel.origin = origin_;
  channel.scale = scale_;
  channel.offset = offset_;
  channel.gamma = gamma_;
  channel.density = density_;
  channel.opacity = opacity_.view();
  return kernel::largestExtinction(channel, interval.lo, interval.hi);
}

bool TransferFunction::invisible() const {
  return density_ == 0.0f || *std::max_element(opacity_.values.begin(), opacity_.values.end()) == 0.0f;
}

}  // namespace scolopax
