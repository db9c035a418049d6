// SPDX-License-Identifier: Apache-2.0
// What channels do on a segment of every ray: kernel/optical_curve.h and kernel::partAlone, bit by bit.
#pragma once
#include <algorithm>
#include <bit>

#include "renderer/cpu/lanes.h"
#include "renderer/kernel/raymarch.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// Where rays are on a channel's curves, and on which piece.
struct Place {
  Float position;
  Int piece;
};

struct Knots {
  Float position, inverseWidth, opacity, color[3];
};
inline constexpr int kKnotFloats = sizeof(kernel::OpticalKnot) / sizeof(float);

SCOLOPAX_SIMD Knots knotsAt(const kernel::OpticalCurveView& curve, Int index) {
  const Int at = index * ints(kKnotFloats);
  const kernel::OpticalKnot& first = curve.knots[0];
  return {gather(&first.position, at),
          gather(&first.inverseWidth, at),
          gather(&first.opacity, at),
          {gather(&first.color.x, at), gather(&first.color.y, at), gather(&first.color.z, at)}};
}
SCOLOPAX_SIMD Knots sameKnot(const kernel::OpticalKnot& knot) {
  return {floats(knot.position),
          floats(knot.inverseWidth),
          floats(knot.opacity),
          {floats(knot.color.x), floats(knot.color.y), floats(knot.color.z)}};
}

/// kernel::pieceAt.
SCOLOPAX_SIMD Int piecesAt(const kernel::OpticalCurveView& curve, Float position) {
  const Mask above = position >= floats(0.0f), inside = above & (position < floats(1.0f));
  Int k = gather(curve.buckets, truncated(where(inside, position) * floats(float(kernel::kCurveBuckets))));
  for (;;) {
    const Int following = minimum(k + ints(1), ints(curve.count - 1));
    const Mask on = inside & (gather(&curve.knots[0].position, following * ints(kKnotFloats)) <= position);
    if (!any(on)) break;
    k = k + onesOf(on);
  }
  return select(inside, k, select(above, ints(curve.count - 1), ints(-1)));
}

/// How much of a part is wanted: up to its extinction, emission or moment.
enum class Detail { extinction, emission, moment };

/// kernel::Part of every ray; 0 beyond the detail.
struct Parts {
  Float opacity, emission[3], moment;
};
SCOLOPAX_SIMD Parts noParts() {
  const Float zero = floats(0.0f);
  return {zero, {zero, zero, zero}, zero};
}

/// kernel::opticalIn of both ends of stretches, then kernel::detail::addLinear.
template <Detail kDetail>
SCOLOPAX_SIMD void addLinear(const Knots& a, const Knots& b, Int piece, Float from, Float to, Float start,
                             Float end, Mask which, Parts* parts) {
  const Mask sloped = piece > ints(-1);
  const Float one = floats(1.0f), two = floats(2.0f), width = end - start;
  const Float s = where(sloped, minimum((from - a.position) * a.inverseWidth, one));
  const Float t = where(sloped, minimum((to - a.position) * a.inverseWidth, one));
  const Float u = a.opacity + s * (b.opacity - a.opacity), v = a.opacity + t * (b.opacity - a.opacity);
  parts->opacity = parts->opacity + where(which, width * floats(0.5f) * (u + v));
  const Float left = two * u + v, right = u + two * v, sixth = width * floats(0.166666667f);
  if constexpr (kDetail >= Detail::emission)
    for (int i = 0; i < 3; ++i) {
      const Float rise = b.color[i] - a.color[i];
      const Float emission = left * (a.color[i] + s * rise) + right * (a.color[i] + t * rise);
      parts->emission[i] = parts->emission[i] + where(which, sixth * emission);
    }
  if constexpr (kDetail >= Detail::moment)
    parts->moment = parts->moment + where(which, sixth * (left * start + right * end));
}

/// kernel::meansBetween for some rays, whose positions are numbers.
template <Detail kDetail>
SCOLOPAX_SIMD Parts meansBetween(const kernel::OpticalCurveView& curve, const Place& p, const Place& q,
                                 Mask which) {
  const Float zero = floats(0.0f), one = floats(1.0f);
  const Int step = ints(1), last = ints(curve.count - 1);
  Parts means = noParts();
  const Int same = permuted(p.piece, ints(std::countr_zero(bitsOf(which))));
  if (!any(without(which, (p.piece == same) & (q.piece == same)))) {
    const int k = firstOf(same);
    addLinear<kDetail>(sameKnot(curve.knots[k < 0 ? 0 : k]),
                       sameKnot(curve.knots[k < 0 ? 0 : std::min(k + 1, curve.count - 1)]), p.piece,
                       p.position, q.position, zero, one, which, &means);
    return means;
  }
  const Float scale = one / (q.position - p.position);
  const Mask up = q.piece > p.piece;
  const Int way = select(up, step, ints(-1));
  Float from = p.position, start = zero;
  Int k = p.piece;
  for (Mask on = which; any(on);) {
    const Mask ends = k == q.piece;
    const Knots a = knotsAt(curve, minimum(maximum(k, ints(0)), last));
    const Knots b = knotsAt(curve, minimum(maximum(k + step, ints(0)), last));
    const Float to = select(ends, q.position, select(up, b.position, a.position));
    const Float end = select(ends, one, clamp((to - p.position) * scale, start, one));
    addLinear<kDetail>(a, b, k, from, to, start, end, on & (start < end), &means);
    from = to;
    start = end;
    k = k + way;
    on = without(on, ends);
  }
  return means;
}

/// kernel::partAlone of the channel for some rays; the others have none.
template <Detail kDetail>
SCOLOPAX_SIMD Parts partsOf(const kernel::ChannelView& channel, const Place& from, const Place& to,
                            Mask wanted) {
  const kernel::OpticalCurveView& curve = channel.optical;
  const Float p = from.position, q = to.position;
  const Float first = floats(curve.first), last = floats(curve.last);
  const Mask outside = ((p <= first) & (q <= first)) | ((p >= last) & (q >= last));
  const Mask seen = without(wanted, outside);
  if (!any(seen)) return noParts();
  const Mask numbers = seen & (p == p) & (q == q);
  Parts parts = noParts();
  if (any(numbers)) {
    parts = meansBetween<kDetail>(curve, from, to, numbers);
    const Float density = floats(channel.density);
    parts.opacity = parts.opacity * density;
    for (Float& emission : parts.emission) emission = emission * density;
    parts.moment = parts.moment * density;
  }
  // Beside voxels that are not finite.
  for (unsigned left = bitsOf(without(seen, numbers)); left != 0; left &= left - 1) {
    const int i = std::countr_zero(left);
    const float positions[] = {at(p, i), at(q, i)};
    const kernel::Part part = kernel::partAlone(channel, positions);
    put(part.opacity, i, &parts.opacity);
    for (int c = 0; c < 3; ++c) put(part.emission[c], i, &parts.emission[c]);
    put(part.moment, i, &parts.moment);
  }
  return parts;
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
