// SPDX-License-Identifier: Apache-2.0
// Quadrature along a ray: equal segments from a jittered start, over each of which the scalars are linear and
// the curves exact (the paper's baseline of 5.2-5.3 takes one point instead). Lighting is worked out once for
// every stratum of absorbed light, a thin one (raymarch) or not (hybrid). Biased; of order 2 in the step.
#pragma once
#include <type_traits>

#include "renderer/kernel/segments.h"
#include "renderer/kernel/shade.h"

namespace scolopax::kernel {

/// Transmittance below which what lies behind no longer shows, not even in float pictures of high contrast.
inline constexpr float kOpaqueTransmittance = 1e-4f;
/// The optical depth of it.
inline constexpr float kOpaqueDepth = 9.21034f;

/// What one channel does on a segment: means over the segment of its part in the extinction that is seen, of
/// that times its colour, and of that times the place in [0,1]. Per world unit.
using Part = StretchMeans;

SCOLOPAX_HD inline Part scaled(const Part& part, float factor) {
  return {part.opacity * factor, part.emission * factor, part.moment * factor};
}

/// Part of channel n on segment k of a run, as if it were alone. Next to voxels that are not finite only the
/// half of the segment that has a value counts.
SCOLOPAX_HD inline Part partAlone(const ChannelView& channel, const float* position) {
  const float p = position[0], q = position[1];
  const OpticalCurveView& curve = channel.optical;
  if ((p <= curve.first && q <= curve.first) || (p >= curve.last && q >= curve.last)) return {};
  if (p == p && q == q) return scaled(meansBetween(curve, p, q), channel.density);
  if (p != p && q != q) return {};
  const float finite = p == p ? p : q;
  return scaled(meansBetween(curve, finite, finite), 0.5f * channel.density);
}

/// Where channels hide each other, extinctions are compared at this many places of a segment, and at this
/// many where a channel's curve is not one line on it.
inline constexpr int kPlaces = 2, kPlacesAtKnots = 8;

/// Channels of one segment where only the largest extinction counts (Eq. 8).
struct Largests {
  int places;
  float extinction[kPlacesAtKnots];
  int channel[kPlacesAtKnots];
};

/// In their place where extinctions add up.
struct NoLargests {};
template <class Blend>
using LargestsOf = std::conditional_t<Blend::kSums, NoLargests, Largests>;

/// What a channel is at a place in [0,1] of a segment.
SCOLOPAX_HD inline Optical opticalOn(const ChannelView& channel, const float* position, float place) {
  float p = position[0], q = position[1];
  if (p != p) p = q;
  if (q != q) q = p;
  if (p != p) return {0.0f, glm::vec3(0.0f)};
  Optical optical = opticalAt(channel.optical, p + place * (q - p));
  optical.opacity *= channel.density;
  return optical;
}

SCOLOPAX_HD inline void findLargests(const SceneView& scene, const SegmentRun& run, int k,
                                     Largests& largests) {
  largests.places = kPlaces;
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(run.active[k] >> n & 1)) continue;
    const OpticalCurveView& curve = scene.channels[n].optical;
    if (pieceAt(curve, run.position[n][k]) != pieceAt(curve, run.position[n][k + 1]))
      largests.places = kPlacesAtKnots;
  }
  for (int i = 0; i < largests.places; ++i) {
    const float place = (float(i) + 0.5f) / float(largests.places);
    largests.extinction[i] = 0.0f;
    largests.channel[i] = 0;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(run.active[k] >> n & 1)) continue;
      const float extinction = opticalOn(scene.channels[n], &run.position[n][k], place).opacity;
      if (extinction > largests.extinction[i]) largests.extinction[i] = extinction, largests.channel[i] = n;
    }
  }
}
SCOLOPAX_HD inline float meanOf(const Largests& largests) {
  float sum = 0.0f;
  for (int i = 0; i < largests.places; ++i) sum += largests.extinction[i];
  return sum / float(largests.places);
}

/// The same of channel n among others: in max where it is the largest, in mix weighted.
template <class Blend>
SCOLOPAX_HD Part partAmong(const ChannelView& channel, int n, const float* position,
                           const Largests& largests) {
  Part part;
  const float share = 1.0f / float(largests.places);
  for (int i = 0; i < largests.places; ++i) {
    if (!Blend::kMixes && largests.channel[i] != n) continue;
    const float place = (float(i) + 0.5f) * share;
    const Optical o = opticalOn(channel, position, place);
    const float seen = o.opacity * share * (Blend::kMixes ? channel.weight : 1.0f);
    part.opacity += seen;
    part.emission += seen * o.color;
    part.moment += seen * place;
  }
  return part;
}

/// What the channels of a walk's segment do on it. One channel alone needs no comparisons.
template <class Blend>
class SegmentParts {
 public:
  /// `largests` is apart from the rest as SegmentRun is.
  SCOLOPAX_HD SegmentParts(LargestsOf<Blend>& largests, const SceneView& scene, const SegmentWalk& walk)
      : largests_(largests), scene_(scene), run_(walk.run()), k_(walk.k()) {
    if constexpr (!Blend::kSums) {
      compared_ = (run_.active[k_] & (run_.active[k_] - 1)) != 0;
      if (compared_) findLargests(scene, run_, k_, largests_);
    }
  }

  /// Calls visit(n, part) for every channel that is seen, and returns the mean extinction.
  template <class Visit>
  SCOLOPAX_HD float visit(Visit&& visit) const {
    float extinction = 0.0f;
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(run_.active[k_] >> n & 1)) continue;
      const ChannelView& channel = scene_.channels[n];
      const float* position = &run_.position[n][k_];
      Part part;
      if constexpr (!Blend::kSums) {
        if (compared_) {
          part = partAmong<Blend>(channel, n, position, largests_);
          if (part.opacity > 0.0f) visit(n, part);
          continue;
        }
      }
      part = partAlone(channel, position);
      if (!(part.opacity > 0.0f)) continue;
      extinction += part.opacity;
      if constexpr (!Blend::kMixes)
        visit(n, part);
      else if (channel.weight > 0.0f)
        visit(n, scaled(part, channel.weight));
    }
    if constexpr (!Blend::kSums)
      if (compared_) return meanOf(largests_);
    return extinction;
  }

 private:
  LargestsOf<Blend>& largests_;
  const SceneView& scene_;
  const SegmentRun& run_;
  int k_;
  bool compared_ = false;
};

/// Step of shadow rays, in steps: what they find is one factor of the light, and varies less.
inline constexpr float kShadowSteps = 2.0f;

/// Transmittance of a shadow ray; `only` >= 0: of one channel.
template <class Blend>
SCOLOPAX_HD float marchTransmittance(const SceneView& scene, const Ray& ray, Interval inside, int only,
                                     float offset, SampleCost* cost) {
  float depth = 0.0f;
  SegmentRun run;
  LargestsOf<Blend> largests;
  SegmentWalk walk(run, scene, ray, inside, only, offset, kShadowSteps * scene.step, cost);
  while (depth < kOpaqueDepth && walk.next())
    depth += SegmentParts<Blend>(largests, scene, walk).visit([](int, const Part&) {}) * walk.length();
  return 1.0f - absorbed(depth);
}

SCOLOPAX_HD inline Collision collisionAt(const SceneView& scene, const Ray& ray, float t, int channel) {
  glm::vec3 point = ray.origin + t * ray.direction;
  for (int axis = 0; axis < 3; ++axis)  // rounding may have left the box, and a ray from there sees nothing
    point[axis] = clamp(point[axis], -0.5f, float(scene.dims[axis]) - 0.5f);
  return {{t, 0.0f}, point, channel, 0.0f};
}

/// A place that is drawn in proportion to weights.
struct WeightedPlace {
  float weight, draw, t;
};

/// What a stratum knows of its channels; apart from the rest as SegmentRun is.
struct StrataChannels {
  WeightedPlace place[kMaxVisibleChannels];
  glm::vec3 emission[kMaxVisibleChannels];
};

/// Gathers what channels absorb of a ray's light until there is a stratum of it, and lights that: each
/// channel at one place, drawn with probability in proportion to what it absorbed, with the lights that are
/// seen from such a place of them all.
template <class Blend, class Features>
class Strata {
 public:
  SCOLOPAX_HD Strata(StrataChannels& channels, const SceneView& scene, const Ray& ray, int only,
                     Sampler& sampler, SampleCost* cost)
      : channels_(channels), scene_(scene), ray_(ray), only_(only), sampler_(sampler), cost_(cost) {}

  /// `weight`, above kLeastNormal, for its colour is divided by it: of channel n's light, with `emission`
  /// that times its mean colour; absorbed about t.
  SCOLOPAX_HD void add(int n, float weight, glm::vec3 emission, float t) {
    if (all_.weight == 0.0f) {
      random_ = sampler_.next();
      ++cost_->randomBlocks;
      all_.draw = uniformOf(random_.x);
      lit_ = 0;
    }
    WeightedPlace& place = channels_.place[n];
    if (!(lit_ >> n & 1)) {
      lit_ |= 1u << n;
      place = {0.0f, uniformOf(random_.y + std::uint32_t(n) * 0x9e3779b9u), 0.0f};
      channels_.emission[n] = glm::vec3(0.0f);
    }
    channels_.emission[n] += emission;
    draw(place, weight, t);
    draw(all_, weight, t);
  }
  SCOLOPAX_HD bool isFull() const { return all_.weight >= scene_.stratum; }

  /// Light of the stratum, which begins anew.
  SCOLOPAX_HD glm::vec3 finish() {
    glm::vec3 color(0.0f);
    if (all_.weight == 0.0f) return color;
    const float offset = uniformOf(random_.z);
    const Visibility visibility = visibilityAt<Features>(
        scene_, ray_, collisionAt(scene_, ray_, all_.t, 0), [&](const Ray& shadow, Interval part) {
          return marchTransmittance<Blend>(scene_, shadow, part, only_, offset, cost_);
        });
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(lit_ >> n & 1)) continue;
      const WeightedPlace& place = channels_.place[n];
      color += place.weight * lit<Features>(scene_, scene_.channels[n],
                                            channels_.emission[n] * (1.0f / place.weight), ray_,
                                            collisionAt(scene_, ray_, place.t, n), visibility, cost_);
    }
    all_.weight = 0.0f;
    return color;
  }

 private:
  /// One number serves all draws: what is left of it after a draw is uniform again.
  SCOLOPAX_HD static void draw(WeightedPlace& place, float weight, float t) {
    place.weight += weight;
    const float chance = weight / place.weight;
    if (place.draw < chance) {
      place.draw = place.draw / chance;
      place.t = t;
    } else {
      place.draw = (place.draw - chance) / (1.0f - chance);
    }
  }

  StrataChannels& channels_;
  const SceneView& scene_;
  const Ray& ray_;
  int only_;
  Sampler& sampler_;
  SampleCost* cost_;
  RandomBlock random_{};
  WeightedPlace all_{};
  std::uint32_t lit_ = 0;  // channels of the stratum
};

/// The channel that a collision on a segment happens in; `pick` in [0,1) decides where extinctions add up.
template <class Blend>
SCOLOPAX_HD int channelOf(const SegmentParts<Blend>& parts, float extinction, float pick) {
  float left = pick * extinction, most = -1.0f;
  int channel = 0;
  bool found = false;
  parts.visit([&](int n, const Part& part) {
    if (Blend::kMixes ? part.opacity > most : !found) channel = n, most = part.opacity;
    left -= part.opacity;
    found = found || left < 0.0f;
  });
  return channel;
}

/// Premultiplied RGBA of a ray; `only` >= 0 marches that channel alone.
template <class Blend, class Features>
SCOLOPAX_HD glm::vec4 marchRay(const SceneView& scene, const Ray& ray, Interval inside, int only,
                               Sampler& sampler, Sampler& ofStrata, SampleCost* cost, FirstCollision* first) {
  glm::vec3 color(0.0f);
  float transmittance = 1.0f, opacity = 0.0f;  // both: 1 - transmittance would lose what is thin
  const RandomBlock random = sampler.next();
  // A tracker's ray would end where the opacity passes this number.
  const float end = first ? uniformOf(random.y) : kInfinity;
  bool ended = false;
  [[maybe_unused]] StrataChannels channels;
  [[maybe_unused]] Strata<Blend, Features> strata(channels, scene, ray, only, ofStrata, cost);
  SegmentRun run;
  LargestsOf<Blend> largests;
  SegmentWalk walk(run, scene, ray, inside, only, uniformOf(random.x), scene.step, cost);
  for (bool more = true; more;) {
    more = walk.next();
    if (more) {
      const float length = walk.length();
      const SegmentParts<Blend> parts(largests, scene, walk);
      glm::vec3 emission(0.0f);
      const float extinction = parts.visit([&](int, const Part& part) { emission += part.emission; });
      if (!(extinction > 0.0f)) continue;
      const float alpha = absorbed(extinction * length);
      const float absorbedHere = transmittance * alpha;
      const float scale = absorbedHere / extinction;
      if constexpr (Features::kAny) {
        parts.visit([&](int n, const Part& part) {
          const float t = walk.start() + minimum(part.moment / part.opacity, 1.0f) * length;
          const float weight = part.opacity * scale;
          if (weight > kLeastNormal) strata.add(n, weight, part.emission * scale, t);
        });
      } else {
        color += emission * scale;
      }
      const float before = opacity;
      opacity += absorbedHere;
      transmittance *= 1.0f - alpha;
      if (!ended && opacity > end) {
        ended = true;
        const float pick = (end - before) / absorbedHere;
        keepNearer(first,
                   {walk.start() + pick * length, only < 0 ? channelOf(parts, extinction, pick) : only});
      }
      more = transmittance > kOpaqueTransmittance;
    }
    if constexpr (Features::kAny)  // in one place, which is compiled once
      if (strata.isFull() || !more) color += strata.finish();
  }
  return glm::vec4(color, minimum(opacity, 1.0f));
}

struct RayMarch {
  template <class Blend, class Features>
  SCOLOPAX_HD static glm::vec4 sample(const SceneView& scene, const Ray& ray, Interval inside,
                                      Sampler& sampler, SampleCost* cost, FirstCollision* first) {
    Sampler ofStrata = sampler.aside();  // one for all channels: their draws are independent
    if constexpr (Blend::kSeparate) {
      glm::vec3 color(0.0f);
      float opacity = 0.0f;
      for (int n = 0; n < scene.channelCount; ++n) {
        const glm::vec4 alone =
            marchRay<Blend, Features>(scene, ray, inside, n, sampler, ofStrata, cost, first);
        color += glm::vec3(alone);
        opacity += (1.0f - opacity) * alone.w;
      }
      return glm::vec4(color, opacity);
    } else {
      return marchRay<Blend, Features>(scene, ray, inside, -1, sampler, ofStrata, cost, first);
    }
  }
};

}  // namespace scolopax::kernel
