// SPDX-License-Identifier: Apache-2.0
// Ray marching by quadrature, one ray per lane. Segments are of equal length, from a jittered start, and
// scalars are taken to be linear on them; or segments end at the faces of voxel cells, between which scalars
// are cubics, and are shorter where matter is dense. Curves are integrated over each segment (the paper's
// baseline of 5.2-5.3 takes one point instead). Lighting is computed once per stratum of absorbed light.
// Biased; the error is of second order in the segments' length.
#pragma once
#include "renderer/kernel/sample_records.h"
#include "renderer/kernel/strata.h"

namespace scolopax::kernel {

/// Linear premultiplied RGBA.
template <class L>
struct Radiance {
  typename L::Vec color;
  typename L::Float opacity;
};

/// Collisions on a segment. `share`, in [0,1), is how much of what the segment absorbs is absorbed in front
/// of them.
template <class L>
struct SegmentCollision {
  Segment<L> segment;
  typename L::Float extinction, share;
  typename L::Mask which;
};

/// Records collisions that are nearer than the rays' nearest so far. The share chooses one of the channels'
/// visible parts and, within it, the distance. Where the largest extinction hides the others, these parts
/// have no weights: as for trackers, the channel is that of the largest extinction.
template <class L, class Blend, class View, class Scalars>
SCOLOPAX_LANES_APART void meet(const View& scene, const Blend& blend, const Scalars& scalars,
                               Hidden<L, Blend::kSums>& hidden, const SegmentCollision<L>& collision,
                               FirstCollisionOf<L>* first) {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;
  Float left = collision.share * collision.extinction, share(0.0f), centre(0.5f);
  Int channel(0);
  Mask open = collision.which;
  Blend unweighted = blend;
  unweighted.mixes = false;
  visitParts<Detail::moment>(scene, unweighted, collision.segment, scalars, hidden,
                             [&](int n, const PartOf<L>& part) SCOLOPAX_LANES_LAMBDA {
                               const Mask seen = open & (part.opacity > 0.0f);
                               channel = select(seen, Int(n), channel);
                               share = select(seen, left / part.opacity, share);
                               centre = select(seen, part.moment / part.opacity, centre);
                               left = select(seen, left - part.opacity, left);
                               open = without(open, left < 0.0f);
                             });
  const Float length = collision.segment.length();
  const Float along = placeOfAbsorption(collision.extinction * length, centre, clamp(share, 0.0f, 1.0f));
  keepNearer(first, collision.which, collision.segment.start + length * along, channel);
}

/// State of the rays at a surface.
template <class L>
struct Marched {
  typename L::Float transmittance;
  typename L::Float opacity;  ///< of surfaces
  typename L::Vec color;      ///< what they have added
  typename L::Mask open;      ///< rays that a tracker would have followed up to here
};

/// What changes along rays from segment to segment, except the colour of matter, to which strata add. Kept in
/// registers: only parts of marchRay() take it by reference.
template <class L>
struct MarchState {
  using Float = typename L::Float;
  using Mask = typename L::Mask;

  Float end;  ///< a tracker's ray would end where the opacity passes this number
  Mask open;  ///< rays that a tracker would have followed up to here
  Float transmittance{1.0f};
  Float opacity{0.0f};  ///< of matter; 1 - transmittance would lose the digits of thin matter
  Float solid{0.0f};    ///< opacity of surfaces; apart from that of matter, which is lit in strata
  typename L::Vec ofSurfaces{0.0f};  ///< what surfaces have added to the colour

  /// Rays that are not opaque yet.
  SCOLOPAX_LANES_PART Mask continuing(const OpacityLimit& opaque) const {
    return transmittance > opaque.transmittance;
  }
  /// Absorbs light in matter of the given optical depth. Returns how much.
  SCOLOPAX_LANES_PART Float absorb(Float depth) {
    const Float alpha = absorbed(depth), absorbedHere = transmittance * alpha;
    opacity = opacity + absorbedHere;
    transmittance = transmittance * (1.0f - alpha);
    return absorbedHere;
  }
  /// Of the rays in `which`, those whose tracker would have ended in the matter absorbed last. Where a ray
  /// ends because it is opaque, a tracker's ray would hardly have come further.
  SCOLOPAX_LANES_PART Mask endIn(Mask which, const OpacityLimit& opaque) {
    const Mask ends = open & which & ((opacity + solid > end) | without(L::everywhere(), continuing(opaque)));
    open = without(open, ends);
    return ends;
  }
  /// A copy for functions that are not inlined, so that the state itself need not be in memory.
  SCOLOPAX_LANES_PART Marched<L> marched() const { return {transmittance, solid, ofSurfaces, open}; }
  SCOLOPAX_LANES_PART void take(const Marched<L>& marched) {
    transmittance = marched.transmittance;
    solid = marched.opacity;
    ofSurfaces = marched.color;
    open = marched.open;
  }
};

/// Adds the surfaces that rays meet up to `reached`. A tracker's ray would end where the opacity of surfaces
/// passes `end`; `offset` is the jitter of shadow rays.
template <class Lighting, class Steps, class L, class Blend, class View>
SCOLOPAX_LANES_RARE void meetSurfaces(const View& scene, const Blend& blend, const RayOf<L>& ray,
                                      std::uint32_t channels, const typename L::Float& reached,
                                      const typename L::Float& end, const typename L::Float& offset,
                                      const ShadowMemory<L, Steps, Blend, View>& ofShadows,
                                      SurfacesAhead<L>& ahead, Marched<L>& light, CostOf<L>* cost,
                                      FirstCollisionOf<L>* first) {
  using Float = typename L::Float;
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;
  [[maybe_unused]] StratumPoints<L> points;
  for (;;) {
    const SurfaceHit<L>& hit = ahead.hit();
    const Mask met =
        (hit.t < kInfinity) & (hit.t <= reached) & (light.transmittance > scene.opaque.transmittance);
    if (!any(met)) return;
    Vec radiance = hit.color;
    if constexpr (Lighting::kAny) {
      points.t = hit.t;
      points.offset = offset;
      points.kept = Word(0u);
      for (int n = 0; n < scene.channelCount; ++n) {
        const Mask here = met & (hit.surface.channel == typename L::Int(n));
        if (!any(here)) continue;
        points.kept = points.kept | where(here, Word(1u << n));
        points.share[n] = Float(1.0f);
        points.color[n] = hit.color;
      }
      findLight<Steps, L>(scene, blend, ray, channels, points, hit.surface, met, ofShadows, cost, &radiance);
    }
    const Float absorbedHere = where(met, light.transmittance * hit.opacity);
    light.color = light.color + radiance * absorbedHere;
    light.opacity = light.opacity + absorbedHere;
    light.transmittance = select(met, light.transmittance * (1.0f - hit.opacity), light.transmittance);
    const Mask ends = light.open & met & (light.opacity > end);
    light.open = without(light.open, ends);
    if (first) keepNearer<L>(first, ends, hit.t, hit.surface.channel);
    ahead.advance(met);
  }
}

/// Means of all channels over a segment.
template <class L>
struct SegmentMeans {
  typename L::Float extinction;
  typename L::Vec emission;
};

/// Integrates the channels over a segment. If such segments can be divided, shortens it first while it is too
/// thick. Keeps the parts of the channels in `memory`, that of the strata, for lighting.
template <class Lighting, class Steps, class L, class Blend, class View, class Scalars, class Cuts,
          class Memory>
SCOLOPAX_LANES_PART SegmentMeans<L> integrate(const View& scene, const Blend& blend, const Scalars& scalars,
                                              typename L::Float transmittance, Cuts& along,
                                              Segment<L>& segment, Hidden<L, Blend::kSums>& hidden,
                                              [[maybe_unused]] Memory& memory) {
  constexpr Detail kDetail = Lighting::kAny ? Detail::moment : Detail::emission;
  for (;;) {
    typename L::Vec emission(0.0f);
    const typename L::Float extinction = visitParts<kDetail>(
        scene, blend, segment, scalars, hidden, [&](int n, const PartOf<L>& part) SCOLOPAX_LANES_LAMBDA {
          if constexpr (Lighting::kAny) memory.parts[n] = part;
          emission = emission + part.emission;
        });
    if constexpr (Steps::kDivides) {
      if (along.shorten(segment, extinction * segment.length(), transmittance, scene.thickest)) continue;
    }
    return {extinction, emission};
  }
}

/// Marches rays through `channels` (bit n: visible channel n). `set` keeps the random numbers of several such
/// marches apart.
template <class Lighting, class Steps, class L, class Blend, class View>
SCOLOPAX_LANES Radiance<L> marchRay(const View& scene, const Blend& blend, const RayOf<L>& ray,
                                    const IntervalOf<L>& inside, std::uint32_t channels, int set,
                                    SamplerOf<L>& sampler, const SamplerOf<L>& ofStrata, CostOf<L>* cost,
                                    FirstCollisionOf<L>* first) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;
  using OfStrata = Strata<Steps, L, Blend, View>;
  const Mask meets = inside.enter < inside.exit;
  const auto random = sampler.next(meets);
  MarchState<L> state{uniformOf(random.y), meets};
  Vec color(0.0f);  // of matter
  SurfacesAhead<L> ahead;
  const bool hasSurfaces = scene.hasSurfaces();
  if (hasSurfaces) [[unlikely]]
    ahead.begin(scene, ray, inside, channels, cost);
  typename Steps::template Scalars<L, View> scalars;
  Hidden<L, Blend::kSums> hidden;
  [[maybe_unused]] typename Steps::template Scalars<L, View> scalarsOfShadows;
  // Strata end after the parts of a segment have been used, so that shadow rays may overwrite them.
  const typename OfStrata::OfShadows ofShadows{Lighting::kAny ? &scalarsOfShadows : nullptr,
                                               Lighting::kAny ? &hidden : nullptr};
  [[maybe_unused]] typename OfStrata::Memory memory;
  [[maybe_unused]] OfStrata strata(memory, ofShadows, scene, blend, ray, channels, set, ofStrata, cost);
  Segment<L> segment;
  Spans<L> spans(scene, ray, inside, channels);
  for (bool last = false; !last;) {
    const auto span =
        spans.next(state.continuing(scene.opaque), hasSurfaces ? ahead.hit().t : Float(kInfinity));
    typename Steps::template Cuts<L, View> along(scalars, scene, ray, span, channels, uniformOf(random.x),
                                                 scene.step, cost);
    for (bool more = true; more;) {
      more = along.next(segment);
      const SegmentMeans<L> means = integrate<Lighting, Steps, L>(scene, blend, scalars, state.transmittance,
                                                                  along, segment, hidden, memory);
      const Float extinction = means.extinction, before = state.opacity;
      Vec emission = means.emission;
      const Mask some = extinction > 0.0f;
      if (any(some)) {
        const Float absorbedHere = state.absorb(where(some, extinction * segment.length()));
        more = more && along.keep(state.continuing(scene.opaque));
        emission = emission * where(some, absorbedHere / extinction);
        if constexpr (!Lighting::kAny) color = color + emission;
        if (first) [[unlikely]]
          if (const Mask met = state.endIn(some, scene.opaque); any(met)) {
            // A copy, so that the segment itself need not be in memory.
            SegmentCollision<L> collision{segment, extinction,
                                          (state.end - (before + state.solid)) / absorbedHere, met};
            meet<L>(scene, blend, scalars, hidden, collision, first);
          }
      } else if (more) {
        continue;
      }
      last = !more && spans.done(state.continuing(scene.opaque));
      if constexpr (Lighting::kAny)
        strata.absorb(before, state.opacity, last, segment, extinction, emission, color);
    }
    if (hasSurfaces) [[unlikely]] {
      Marched<L> marched = state.marched();
      meetSurfaces<Lighting, Steps, L>(scene, blend, ray, channels, span.exit, state.end - state.opacity,
                                       uniformOf(random.z), ofShadows, ahead, marched, cost, first);
      state.take(marched);
    }
  }
  return {color + state.ofSurfaces, minimum(state.opacity + state.solid, 1.0f)};
}

template <class Steps>
struct RayMarch {
  template <class Blend, class Lighting, class View>
  SCOLOPAX_HD static glm::vec4 sample(const View& scene, const Ray& ray, Interval inside, Sampler& sampler,
                                      SampleCost* cost, FirstCollision* first) {
    const Blending<Blend::kSums> blend{Blend::kSeparate, Blend::kMixes};
    const Radiance<One> radiance = march<Lighting>(scene, blend, ray, inside, sampler, cost, first);
    return glm::vec4(radiance.color, radiance.opacity);
  }

  template <class Lighting, class L, class Blend, class View>
  SCOLOPAX_LANES static Radiance<L> march(const View& scene, const Blend& blend, const RayOf<L>& ray,
                                          const IntervalOf<L>& inside, SamplerOf<L>& sampler, CostOf<L>* cost,
                                          FirstCollisionOf<L>* first) {
    using Float = typename L::Float;
    const SamplerOf<L> ofStrata = sampler.aside();  // one for all channels: their sets are independent
    Radiance<L> sum{typename L::Vec(0.0f), Float(0.0f)};
    for (int n = 0; n < (blend.separate ? scene.channelCount : 1); ++n) {
      const std::uint32_t channels =
          blend.separate ? 1u << n : ~0u >> (kMaxVisibleChannels - scene.channelCount);
      const Radiance<L> alone = marchRay<Lighting, Steps>(
          scene, blend, ray, inside, channels, blend.separate ? n : 0, sampler, ofStrata, cost, first);
      sum.color = sum.color + alone.color;
      sum.opacity = sum.opacity + (1.0f - sum.opacity) * alone.opacity;
    }
    return sum;
  }
};

}  // namespace scolopax::kernel
