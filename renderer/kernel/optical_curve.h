// SPDX-License-Identifier: Apache-2.0
// Both curves of a channel as one, integrated over a stretch of a ray: between two samples the scalar is
// taken to be linear, and a piecewise-linear curve of it is integrated exactly (pre-integration: Engel, Kraus
// and Ertl 2001). What a stretch hides of itself is left out: colours count by their extinction alone.
#pragma once
#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

/// Opacity and colour at one position.
struct Optical {
  float opacity;
  glm::vec3 color;
};

/// Piece k lies between knots k and k + 1; before the first knot and after the last the curve is constant.
SCOLOPAX_HD inline int pieceAt(const OpticalCurveView& curve, float position) {
  if (!(position >= 0.0f)) return -1;
  if (position >= 1.0f) return curve.count - 1;
  int k = curve.buckets[int(position * float(kCurveBuckets))];
  while (curve.knots[k + 1].position <= position) ++k;  // the last knot's is 1
  return k;
}

/// Value of the line of piece k; at its right end the limit from the left.
SCOLOPAX_HD inline Optical opticalIn(const OpticalCurveView& curve, int k, float position) {
  const OpticalKnot& a = curve.knots[k < 0 ? 0 : k];
  if (k < 0 || k + 1 >= curve.count) return {a.opacity, a.color};
  const OpticalKnot& b = curve.knots[k + 1];
  const float t = minimum((position - a.position) * a.inverseWidth, 1.0f);
  return {a.opacity + t * (b.opacity - a.opacity), a.color + t * (b.color - a.color)};
}

SCOLOPAX_HD inline Optical opticalAt(const OpticalCurveView& curve, float position) {
  return opticalIn(curve, pieceAt(curve, position), position);
}

/// Means over a stretch: of opacity, opacity times colour, and opacity times the place on the stretch, in
/// [0,1].
struct StretchMeans {
  float opacity = 0.0f;
  glm::vec3 emission{0.0f};
  float moment = 0.0f;
};

namespace detail {
/// Adds a part of a stretch, from place s to place e of it, on which both curves are linear; exact.
SCOLOPAX_HD inline void addLinear(const Optical& a, const Optical& b, float s, float e, StretchMeans* means) {
  const float width = e - s;
  means->opacity += width * 0.5f * (a.opacity + b.opacity);
  means->emission += width * 0.166666667f *
                     ((2.0f * a.opacity + b.opacity) * a.color + (a.opacity + 2.0f * b.opacity) * b.color);
  means->moment +=
      width * 0.166666667f * ((2.0f * a.opacity + b.opacity) * s + (a.opacity + 2.0f * b.opacity) * e);
}
}  // namespace detail

/// Over positions from p to q, not NaN; they may lie outside [0,1], where the curve is constant.
SCOLOPAX_HD inline StretchMeans meansBetween(const OpticalCurveView& curve, float p, float q) {
  StretchMeans means;
  const int first = pieceAt(curve, p), last = pieceAt(curve, q);
  if (first == last) {
    detail::addLinear(opticalIn(curve, first, p), opticalIn(curve, first, q), 0.0f, 1.0f, &means);
    return means;
  }
  const float scale = 1.0f / (q - p);
  const int way = first < last ? 1 : -1;
  float from = p, place = 0.0f;
  for (int k = first; k != last + way; k += way) {
    const float to = k == last ? q : curve.knots[way > 0 ? k + 1 : k].position;
    const float next = k == last ? 1.0f : clamp((to - p) * scale, place, 1.0f);
    if (place < next)
      detail::addLinear(opticalIn(curve, k, from), opticalIn(curve, k, to), place, next, &means);
    from = to;
    place = next;
  }
  return means;
}

/// Where a stored value lies on the curves, beyond [0,1] too: linear in the stored value, so that a stretch
/// that leaves the range is cut where it does. With gamma it is clamped. NaN where the value is not finite.
SCOLOPAX_HD inline float stretchPosition(const ChannelView& channel, float stored) {
  constexpr float kFar = 1e6f;
  if (!isFinite(stored)) return __builtin_nanf("");
  const float position = clamp((stored - channel.origin) * channel.scale + channel.offset, -kFar, kFar);
  return channel.gamma == 1.0f ? position : power(clamp(position, 0.0f, 1.0f), channel.gamma);
}

}  // namespace scolopax::kernel
