// SPDX-License-Identifier: Apache-2.0
// Classifiers: how the extinction of a channel follows from its value and from what else it depends on. Each
// is a struct of static functions, and withClassifier() lists them:
// - fetches: trilinear samples that one classification costs, beyond that of the value;
// - extinctionAt: extinction at a point, where the value has a position on the curves;
// - Nearby: at(stored) is the extinction at a point with this value, and bound(lo, hi, way) bounds it where
//   values are between lo and hi, up to `way` (world units) further along the ray. Constructed with the lower
//   voxel of the voxel cell that the point is in, the point, and the ray's direction, in voxels per world
//   unit. Not finite() if no sample of the cell has extinction;
// - sample, passOn, cutPart: set what SegmentEnds and SegmentCubics know of a channel: at a point or at the
//   nodes of a cubic; at the beginning of a segment that continues another; on a part of a segment;
// - partAlone: part of the channel on a segment, as if it were the only one; nothing for rays that are not in
//   `which`;
// - extinctionOn: extinction at a fraction `along` of a segment, where the curve has the given opacity;
// - isStraight: rays for which the extinction is linear on the segment.
#pragma once
#include "renderer/kernel/classifiers/curve.h"
#include "renderer/kernel/classifiers/curve_times_curve.h"

namespace scolopax::kernel {

/// Returns visit(classifier of channel n).
template <class View, class Visit>
SCOLOPAX_LANES decltype(auto) withClassifier(const View& scene, int n, Visit&& visit) {
  if (scene.hasFactor(n)) [[unlikely]]
    return visit(CurveTimesCurve{});
  return visit(Curve{});
}

/// Extinction of one channel at a point, and the position on the channel's curves; both are 0 where the
/// voxels are not finite.
struct Classified {
  float extinction, position;
};
template <class View>
SCOLOPAX_HD Classified classify(const View& scene, int n, glm::vec3 point, SampleCost* cost) {
  const ChannelView& channel = scene.channels[n];
  cost->fetches += channel.field.cost();
  const float stored = sampleStored<One>(channel.field, scene.dims, point);
  if (!isFinite(stored)) return {0.0f, 0.0f};
  const float position = curvePosition(channel, stored);
  return {withClassifier(scene, n,
                         [&](auto classifier) {
                           return classifier.extinctionAt(channel, scene.dims, point, position, cost);
                         }),
          position};
}

/// The functions of the channel's classifier.
template <Detail kDetail, class L, class View, class Scalars>
SCOLOPAX_LANES PartOf<L> partAlone(const View& scene, const Scalars& scalars, int n, typename L::Mask which) {
  return withClassifier(scene, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
    return classifier.template partAlone<kDetail, L>(scene.channels[n], scalars, n, which);
  });
}
template <class L, class View, class Scalars>
SCOLOPAX_LANES typename L::Float extinctionOn(const View& scene, const Scalars& scalars, int n,
                                              typename L::Float along, typename L::Mask which,
                                              typename L::Float opacity) {
  return withClassifier(scene, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
    return classifier.template extinctionOn<L>(scene.channels[n], scalars, n, along, which, opacity);
  });
}
template <class L, class View, class Scalars>
SCOLOPAX_LANES typename L::Mask isStraight(const View& scene, const Scalars& scalars, int n) {
  return withClassifier(scene, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
    return classifier.template isStraight<L>(scene.channels[n], scalars, n);
  });
}
/// Extinction (as `opacity`) and colour of channel n at a fraction `along` of a segment. Undefined for rays
/// that are not in `which`.
template <Detail kDetail, class L, class View, class Scalars>
SCOLOPAX_LANES Optical<L> opticalOn(const View& scene, const Scalars& scalars, int n, typename L::Float along,
                                    typename L::Mask which) {
  Optical<L> optical = curvesOn<kDetail, L>(scene.channels[n], scalars, n, along, which);
  optical.opacity = extinctionOn<L>(scene, scalars, n, along, which, optical.opacity);
  return optical;
}

}  // namespace scolopax::kernel
