// SPDX-License-Identifier: Apache-2.0
// Shadow rays of quadrature: their transmittance.
#pragma once
#include "renderer/kernel/segment_parts.h"
#include "renderer/kernel/surfaces.h"

namespace scolopax::kernel {

/// Step of shadow rays, as a multiple of the scene's step. A shadow ray estimates only one factor of the
/// light, which varies less.
inline constexpr float kShadowSteps = 2.0f;

/// What a shadow ray keeps of the channels on a segment. All shadow rays of a marched ray share it: a device
/// compiler would otherwise reserve memory for it at each place where they are marched.
template <class L, class Steps, class Blend, class View>
struct ShadowMemory {
  typename Steps::template Scalars<L, View>* scalars;
  Hidden<L, Blend::kSums>* hidden;  ///< may be the marched ray's own
};

/// Transmittance of shadow rays through the channels in `channels` (bit n: visible channel n) and their
/// surfaces. `start`: the surface at which the rays begin.
template <class L, class Steps, class Blend, class View>
SCOLOPAX_LANES typename L::Float marchTransmittance(const View& scene, const Blend& blend,
                                                    const RayOf<L>& ray, IntervalOf<L> inside,
                                                    std::uint32_t channels, typename L::Float offset,
                                                    const SurfaceStart<L>& start,
                                                    const ShadowMemory<L, Steps, Blend, View>& memory,
                                                    CostOf<L>* cost) {
  typename L::Float ofSurfaces(1.0f);
  if (scene.hasSurfaces()) [[unlikely]] {
    passSurfaces<L>(scene, ray, inside, channels, start, scene.opaque.transmittance, cost, &ofSurfaces);
    inside.exit = select(ofSurfaces > scene.opaque.transmittance, inside.exit, inside.enter);
  }
  Segment<L> segment;
  typename L::Float depth(0.0f);
  Spans<L> spans(scene, ray, inside, channels);
  do {
    const auto span = spans.next(depth < scene.opaque.depth);
    typename Steps::template WholeCuts<L, View> along(*memory.scalars, scene, ray, span, channels, offset,
                                                      kShadowSteps * scene.step, cost);
    for (bool more = true; more && along.next(segment); more = along.keep(depth < scene.opaque.depth))
      depth = depth + visitParts<Detail::extinction>(scene, blend, segment, *memory.scalars, *memory.hidden,
                                                     [](int, const PartOf<L>&) SCOLOPAX_LANES_LAMBDA {}) *
                          segment.length();
  } while (!spans.done(depth < scene.opaque.depth));
  return ofSurfaces * (1.0f - absorbed(depth));
}

}  // namespace scolopax::kernel
