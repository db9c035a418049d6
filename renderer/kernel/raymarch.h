// SPDX-License-Identifier: Apache-2.0
// Quadrature along a ray: equal segments from a jittered start, over each of which the scalars are linear and
// the curves exact (the paper's baseline of 5.2-5.3 takes one point instead). Lighting is worked out once for
// every stratum of absorbed light, a thin one (raymarch) or not (hybrid). Biased; of order 2 in the step.
#pragma once
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

SCOLOPAX_HD inline Largests largestsOn(const SceneView& scene, const SegmentRun& run, int k) {
  Largests largests;
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
  return largests;
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

/// Calls visit(n, part) for every channel that is seen on a segment, and returns the segment's mean
/// extinction. A run with one channel needs no comparisons.
template <class Blend, class Visit>
SCOLOPAX_HD float visitParts(const SceneView& scene, const SegmentRun& run, int k, Visit&& visit) {
  if constexpr (!Blend::kSums) {
    if ((run.active[k] & (run.active[k] - 1)) != 0) {
      const Largests largests = largestsOn(scene, run, k);
      for (int n = 0; n < scene.channelCount; ++n) {
        if (!(run.active[k] >> n & 1)) continue;
        const Part part = partAmong<Blend>(scene.channels[n], n, &run.position[n][k], largests);
        if (part.opacity > 0.0f) visit(n, part);
      }
      return meanOf(largests);
    }
  }
  float extinction = 0.0f;
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(run.active[k] >> n & 1)) continue;
    const Part part = partAlone(scene.channels[n], &run.position[n][k]);
    if (!(part.opacity > 0.0f)) continue;
    extinction += part.opacity;
    if constexpr (!Blend::kMixes)
      visit(n, part);
    else if (scene.channels[n].weight > 0.0f)
      visit(n, scaled(part, scene.channels[n].weight));
  }
  return extinction;
}

/// Step of shadow rays, in steps: what they find is one factor of the light, and varies less.
inline constexpr float kShadowSteps = 2.0f;

/// Transmittance of a shadow ray; `only` >= 0: of one channel.
template <class Blend>
SCOLOPAX_HD float marchTransmittance(const SceneView& scene, const Ray& ray, Interval inside, int only,
                                     float offset, SampleCost* cost) {
  float depth = 0.0f;
  const auto visit = [&](const SegmentRun& run) {
    for (int k = 0; k < run.count; ++k) {
      depth += visitParts<Blend>(scene, run, k, [](int, const Part&) {}) * (run.t[k + 1] - run.t[k]);
      if (!(depth < kOpaqueDepth)) return false;  // here, not after the run: runs differ between launchers
    }
    return true;
  };
  SegmentWalk(scene, ray, inside, offset, kShadowSteps * scene.step, cost, visit).follow(only);
  return 1.0f - absorbed(depth);
}

SCOLOPAX_HD inline Collision collisionAt(const SceneView& scene, const Ray& ray, float t, int channel) {
  glm::vec3 point = ray.origin + t * ray.direction;
  for (int axis = 0; axis < 3; ++axis)  // rounding may have left the box, and a ray from there sees nothing
    point[axis] = clamp(point[axis], -0.5f, float(scene.dims[axis]) - 0.5f);
  return {{t, 0.0f}, point, channel, 0.0f};
}

/// What absorbs less has no light of its own: its colour is divided by this.
inline constexpr float kLeastWeight = 1.17549435e-38f;

/// Gathers what channels absorb of a ray's light until there is a stratum of it, and lights that: each
/// channel at one place, drawn with probability in proportion to what it absorbed, with the lights that are
/// seen from such a place of them all.
template <class Blend, class Features>
class Strata {
 public:
  SCOLOPAX_HD Strata(const SceneView& scene, const Ray& ray, int only, Sampler& sampler, SampleCost* cost)
      : scene_(scene), ray_(ray), only_(only), sampler_(sampler), cost_(cost) {}

  /// `weight`, above kLeastWeight: of channel n's light, with `emission` that times its mean colour; absorbed
  /// about t.
  SCOLOPAX_HD void add(int n, float weight, glm::vec3 emission, float t) {
    if (all_.weight == 0.0f) {
      random_ = sampler_.next();
      ++cost_->randomBlocks;
      all_.draw = uniformOf(random_.x);
      lit_ = 0;
    }
    Place& place = channels_[n];
    if (!(lit_ >> n & 1)) {
      lit_ |= 1u << n;
      place = {0.0f, uniformOf(random_.y + std::uint32_t(n) * 0x9e3779b9u), 0.0f};
      emission_[n] = glm::vec3(0.0f);
    }
    emission_[n] += emission;
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
      const Place& place = channels_[n];
      color += place.weight * lit<Features>(scene_, scene_.channels[n], emission_[n] * (1.0f / place.weight),
                                            ray_, collisionAt(scene_, ray_, place.t, n), visibility, cost_);
    }
    all_.weight = 0.0f;
    return color;
  }

 private:
  struct Place {
    float weight = 0.0f, draw = 0.0f, t = 0.0f;
  };
  /// One number serves all draws: what is left of it after a draw is uniform again.
  SCOLOPAX_HD static void draw(Place& place, float weight, float t) {
    place.weight += weight;
    const float chance = weight / place.weight;
    if (place.draw < chance) {
      place.draw = place.draw / chance;
      place.t = t;
    } else {
      place.draw = (place.draw - chance) / (1.0f - chance);
    }
  }

  const SceneView& scene_;
  const Ray& ray_;
  int only_;
  Sampler& sampler_;
  SampleCost* cost_;
  RandomBlock random_{};
  Place all_;
  std::uint32_t lit_ = 0;  // channels of the stratum
  Place channels_[kMaxVisibleChannels];
  glm::vec3 emission_[kMaxVisibleChannels];
};

/// The channel that a collision on a segment happens in; `pick` in [0,1) decides where extinctions add up.
template <class Blend>
SCOLOPAX_HD int channelOf(const SceneView& scene, const SegmentRun& run, int k, float pick) {
  float whole = 0.0f;
  visitParts<Blend>(scene, run, k, [&](int, const Part& part) { whole += part.opacity; });
  float left = pick * whole, most = -1.0f;
  int channel = 0;
  bool found = false;
  visitParts<Blend>(scene, run, k, [&](int n, const Part& part) {
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
  [[maybe_unused]] Strata<Blend, Features> strata(scene, ray, only, ofStrata, cost);
  const auto visit = [&](const SegmentRun& run) {
    for (int k = 0; k < run.count; ++k) {
      const float length = run.t[k + 1] - run.t[k];
      glm::vec3 emission(0.0f);
      const float extinction =
          visitParts<Blend>(scene, run, k, [&](int, const Part& part) { emission += part.emission; });
      if (!(extinction > 0.0f)) continue;
      const float alpha = absorbed(extinction * length);
      const float absorbedHere = transmittance * alpha;
      const float scale = absorbedHere / extinction;
      if constexpr (Features::kAny) {
        visitParts<Blend>(scene, run, k, [&](int n, const Part& part) {
          const float t = run.t[k] + minimum(part.moment / part.opacity, 1.0f) * length;
          const float weight = part.opacity * scale;
          if (weight > kLeastWeight) strata.add(n, weight, part.emission * scale, t);
        });
        if (strata.isFull()) color += strata.finish();
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
                   {run.t[k] + pick * length, only < 0 ? channelOf<Blend>(scene, run, k, pick) : only});
      }
      if (!(transmittance > kOpaqueTransmittance)) return false;
    }
    return true;
  };
  SegmentWalk(scene, ray, inside, uniformOf(random.x), scene.step, cost, visit).follow(only);
  if constexpr (Features::kAny) color += strata.finish();
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
