// SPDX-License-Identifier: Apache-2.0
// Clipping: the interval of a ray inside the crop box and clip planes, the channels that are kept at a point,
// and the spans of a ray in which the same channels are kept.
#pragma once
#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

template <class L>
struct IntervalOf {
  typename L::Float enter, exit;   ///< along the ray; empty when enter >= exit
  typename L::Word channels{~0u};  ///< bit n: visible channel n is kept there
};
using Interval = IntervalOf<One>;

/// The part of the ray with t >= 0 inside the box [low, high], low < high; faces belong to the box. Empty for
/// a ray that is not finite or whose direction is zero.
template <class L>
SCOLOPAX_LANES IntervalOf<L> clipToBox(const RayOf<L>& ray, glm::vec3 low, glm::vec3 high) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  IntervalOf<L> inside{Float(0.0f), Float(kInfinity)};
  Mask meets = L::everywhere();
  for (int axis = 0; axis < 3; ++axis) {
    const float lo = low[axis], hi = high[axis];
    const Float o = ray.origin[axis], d = ray.direction[axis];
    const Mask along = d == 0.0f;
    const Float a = (lo - o) / d, b = (hi - o) / d;
    const Float near = minimum(a, b), far = maximum(a, b);
    meets = meets & (without(near <= far, along) | (along & (o >= lo) & (o <= hi)));
    inside.enter = select(along, inside.enter, maximum(inside.enter, near));
    inside.exit = select(along, inside.exit, minimum(inside.exit, far));
  }
  meets = meets & (inside.exit < kInfinity);
  return {where(meets, inside.enter), where(meets, inside.exit)};
}

/// Signed distance of a point from a plane, in voxels; positive on the kept side.
template <class L>
SCOLOPAX_LANES typename L::Float sideOf(const ClipPlaneView& plane, const typename L::Vec& point) {
  return dot(typename L::Vec(plane.normal), point) + plane.offset;
}

/// Rounding error of a slope or side, relative to the sum of the magnitudes that it is computed from.
inline constexpr float kAlongPlane = 0x1p-21f;

/// Intersection of a ray with a plane.
template <class L>
struct PlaneHit {
  typename L::Float side, slope;  ///< signed distance of the ray's origin, and its change per t
  typename L::Float t;            ///< where the ray crosses the plane; infinite or NaN if it is parallel

  SCOLOPAX_LANES PlaneHit(const ClipPlaneView& plane, const RayOf<L>& ray)
      : side(sideOf<L>(plane, ray.origin)),
        slope(dot(typename L::Vec(plane.normal), ray.direction)),
        t(-side / slope) {}
};

/// The interval of the ray that may contain anything: inside the crop box, and on the kept side of all planes
/// that clip all channels.
template <class L>
SCOLOPAX_LANES IntervalOf<L> clipToScene(const SceneView& scene, const RayOf<L>& ray) {
  using Mask = typename L::Mask;
  IntervalOf<L> inside = clipToBox(ray, scene.clip.low, scene.clip.high);
  for (int i = 0; i < scene.clip.wholePlanes; ++i) {
    const ClipPlaneView& plane = scene.clip.planes[i];
    const PlaneHit<L> hit(plane, ray);
    // Rounding may tilt a ray that is parallel to the plane, and move its origin slightly off the plane.
    const auto reach = sumOfMagnitudes(ray.direction) * kAlongPlane;
    const Mask begins = hit.slope > reach, ends = hit.slope < -reach;
    const Mask kept = hit.side + sumOfMagnitudes(ray.origin) * kAlongPlane >= 0.0f;
    inside.enter = select(begins, maximum(inside.enter, hit.t), inside.enter);
    inside.exit = select(ends, minimum(inside.exit, hit.t), inside.exit);
    inside.exit = select(begins | ends | kept, inside.exit, inside.enter);
  }
  return inside;
}

/// A point of the clipped volume, moved back if rounding has put it outside the crop box or behind a plane
/// that clips all channels. A ray that starts outside may miss the volume.
template <class L>
SCOLOPAX_LANES typename L::Vec insideOf(const ClipView& clip, typename L::Vec point) {
  for (int axis = 0; axis < 3; ++axis) point[axis] = clamp(point[axis], clip.low[axis], clip.high[axis]);
  for (int i = 0; i < clip.wholePlanes; ++i) {
    const auto beyond = minimum(sideOf<L>(clip.planes[i], point), 0.0f);
    point = point - typename L::Vec(clip.planes[i].normal) * beyond;
  }
  return point;
}

/// Bits of the visible channels that are kept at a point by the crop regions and by the planes that clip only
/// some channels.
template <class L>
SCOLOPAX_LANES typename L::Word channelsAt(const ClipView& clip, const typename L::Vec& point) {
  using Int = typename L::Int;
  using Word = typename L::Word;
  Int region(0);
  for (int axis = 2; axis >= 0; --axis)
    region = region * 3 + onesOf(point[axis] >= clip.cropAt[0][axis]) +
             onesOf(point[axis] >= clip.cropAt[1][axis]);
  Word channels = Word(gather(clip.regions, region));
  for (int i = clip.wholePlanes; i < clip.planeCount; ++i) {
    const auto kept = sideOf<L>(clip.planes[i], point) >= 0.0f;
    channels = channels & select(kept, Word(~0u), Word(~clip.planes[i].channels));
  }
  return channels;
}

/// Divides rays into spans, front to back, in each of which the same channels are kept.
template <class L>
class Spans {
 public:
  using Float = typename L::Float;
  using Word = typename L::Word;
  using Mask = typename L::Mask;

  /// `channels`: bit n is visible channel n; how other channels are clipped does not matter.
  SCOLOPAX_LANES Spans(const SceneView& scene, const RayOf<L>& ray, const IntervalOf<L>& inside,
                       std::uint32_t channels)
      : clip_(scene.clip), ray_(ray), rest_(inside), channels_(channels) {}

  /// Returns the next span of every ray in `wants`. It is empty for other rays, where none of the channels is
  /// kept, and at the end.
  SCOLOPAX_LANES IntervalOf<L> next(Mask wants) { return next(wants, Float(kInfinity)); }
  /// The same, with spans that end at `limit` at the latest.
  SCOLOPAX_LANES IntervalOf<L> next(Mask wants, Float limit) {
    IntervalOf<L> span = rest_;
    span.exit = minimum(span.exit, maximum(span.enter, limit));
    Mask some = wants;
    if (clip_.parts) {
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
          end(span, (clip_.cropAt[side][axis] - ray_.origin[axis]) / ray_.direction[axis]);
      for (int i = clip_.wholePlanes; i < clip_.planeCount; ++i)
        if ((clip_.planes[i].channels & channels_) != 0) end(span, PlaneHit<L>(clip_.planes[i], ray_).t);
      const Float middle = 0.5f * (span.enter + span.exit);
      span.channels = channelsAt<L>(clip_, ray_.origin + middle * ray_.direction);
      some = without(some, (span.channels & Word(channels_)) == Word(0u));
    }
    rest_.enter = span.exit;
    span.exit = select(some, span.exit, span.enter);
    return span;
  }
  /// Whether no ray in `wants` has a further span.
  SCOLOPAX_LANES bool done(Mask wants) const { return !any(wants & (rest_.enter < rest_.exit)); }

 private:
  /// Ends the span at a face at t. For a ray parallel to the face, t is infinite or NaN and changes nothing.
  SCOLOPAX_LANES static void end(IntervalOf<L>& span, Float t) {
    span.exit = select((t > span.enter) & (t < span.exit), t, span.exit);
  }

  const ClipView& clip_;
  const RayOf<L>& ray_;
  IntervalOf<L> rest_;
  std::uint32_t channels_;
};

}  // namespace scolopax::kernel
