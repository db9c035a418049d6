// SPDX-License-Identifier: Apache-2.0
// Light of a marched ray. What the ray absorbs of its light is divided into equal strata; each is lit at one
// place, where visibility and the shading of every channel are taken together. raymarch has 64 strata,
// hybrid 8.
#pragma once
#include "renderer/kernel/segment_parts.h"
#include "renderer/kernel/shade.h"

namespace scolopax::kernel {

/// Optical depth behind which a shadow ray sees no light: a transmittance of 1e-4.
inline constexpr float kOpaqueDepth = 9.21034f;
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

/// A segment as light sees it.
struct AbsorbingSegment {
  float start, length, extinction;
};

/// Where in a segment, in [0,1], the first `part` of what it absorbs is absorbed. Its extinction is taken to
/// be linear, with its centre at `centre` as far as that can be.
SCOLOPAX_HD inline float placeOfAbsorption(float part, float depth, float centre) {
  const float passed = minimum(part * absorbed(depth), 0x1.fffffep-1f);
  const float share = minimum(opticalDepth(passed) / depth, 1.0f);
  const float slope = clamp(6.0f * centre - 3.0f, -1.0f, 1.0f);
  const float rest = 1.0f - slope;
  const float below = rest + squareRoot(rest * rest + 4.0f * slope * share);
  return minimum(2.0f * share / maximum(below, kLeastNormal), 1.0f);
}

/// The channels at the place where a stratum will be lit; apart from the rest as SegmentRun is.
struct StratumChannels {
  float share[kMaxVisibleChannels];  ///< of the extinction
  glm::vec3 color[kMaxVisibleChannels];
};

/// Lights the strata [j, j + 1) / K of a ray's light, front to back: each at one place that is uniform in
/// what it absorbs, found with random numbers that depend on the sample and on j alone. Pictures of different
/// steps so light nearly the same places.
///
/// How much the last stratum of a ray holds is known only at its end, and remembering all that may be lit is
/// out of the question. So the places of stratum j are the records u1, u1 u2, u1 u2 u3, ... of a unit
/// interval, u uniform: the largest that is at most m is uniform in [0, m), whatever m is (the records of a
/// Poisson process are scale-free). As absorption passes a record, the place moves on to it.
///
/// Strata that end within one and the same segment share a place: light hardly varies there.
template <class Blend, class Features>
class Strata {
 public:
  SCOLOPAX_HD Strata(StratumChannels& channels, const SceneView& scene, const Ray& ray, int only,
                     const Sampler& sampler, SampleCost* cost)
      : channels_(channels), scene_(scene), ray_(ray), only_(only), sampler_(sampler), cost_(cost) {}

  /// Takes what a segment absorbs, [before, after) of the ray's light; `last` if the ray ends with it. Adds
  /// the light of the strata that are complete to `color`.
  SCOLOPAX_HD void absorb(float before, float after, bool last, const AbsorbingSegment& segment,
                          const SegmentParts<Blend>& parts, glm::vec3& color) {
    const int reached = int(after / scene_.stratum);
    for (;;) {  // twice at most, for what is left of the segment; in one place, which is compiled once
      const bool full = reached > index_;
      const float end = full ? float(reached) * scene_.stratum : after;
      const float mass = end - begin_, earlier = maximum(before - begin_, 0.0f);
      if (mass > earlier) {
        if (next_ == 0.0f) draw();
        const float place = reached > index_ + 1 ? shared_ * mass
                            : mass < next_       ? -1.0f
                                                 : largestRecord(mass);
        if (place >= earlier) keep((place + begin_ - before) / (after - before), segment, parts);
      }
      if (!full && !last) return;
      if (mass > 0.0f) color += mass * light();
      index_ = reached;
      begin_ = end;
      next_ = 0.0f;
      if (!(after > end)) return;
    }
  }

 private:
  SCOLOPAX_HD void draw() {
    const std::uint32_t strata = std::uint32_t(1.0f / scene_.stratum) + 1;
    const RandomBlock random =
        sampler_.at(std::uint32_t(only_ < 0 ? 0 : only_) * strata + std::uint32_t(index_));
    ++cost_->randomBlocks;
    first_ = uniformOf(random.x) * scene_.stratum;
    chain_ = random.y;
    offset_ = uniformOf(random.z);
    shared_ = uniformOf(hashOf(random.z));
  }

  /// Of the stratum's, at most `mass`; the one above it is the next.
  SCOLOPAX_HD float largestRecord(float mass) {
    float record = first_;
    std::uint32_t chain = chain_;
    next_ = kInfinity;
    while (record > mass) {
      next_ = record;
      record *= uniformOf(chain);
      chain = hashOf(chain + 0x9e3779b9u);
    }
    return record;
  }

  SCOLOPAX_HD void keep(float part, const AbsorbingSegment& segment, const SegmentParts<Blend>& parts) {
    float opacity = 0.0f, moment = 0.0f;
    kept_ = 0;
    parts.visit([&](int n, const Part& own) {
      opacity += own.opacity;
      moment += own.moment;
      if (!(own.opacity > kLeastNormal)) return;  // its colour would not be a number
      kept_ |= 1u << n;
      channels_.share[n] = own.opacity / segment.extinction;
      channels_.color[n] = own.emission * (1.0f / own.opacity);
    });
    place_ = segment.start +
             segment.length * placeOfAbsorption(part, segment.extinction * segment.length, moment / opacity);
  }

  /// Of a unit of absorbed light at the place that is kept.
  SCOLOPAX_HD glm::vec3 light() {
    const Collision hit = collisionAt(scene_, ray_, place_, 0);
    const Visibility visibility =
        visibilityAt<Features>(scene_, ray_, hit, [&](const Ray& shadow, Interval part) {
          return marchTransmittance<Blend>(scene_, shadow, part, only_, offset_, cost_);
        });
    glm::vec3 color(0.0f);
    for (int n = 0; n < scene_.channelCount; ++n)
      if (kept_ >> n & 1)
        color += channels_.share[n] *
                 lit<Features>(scene_, scene_.channels[n], channels_.color[n], ray_, hit, visibility, cost_);
    return color;
  }

  StratumChannels& channels_;
  const SceneView& scene_;
  const Ray& ray_;
  int only_;
  const Sampler& sampler_;
  SampleCost* cost_;
  int index_ = 0;
  float begin_ = 0.0f;  // of the stratum, in absorbed light
  float next_ = 0.0f;   // record at which its place moves on; 0: none has been drawn
  float first_ = 0.0f, offset_ = 0.0f, shared_ = 0.0f;
  std::uint32_t chain_ = 0;
  float place_ = 0.0f;  // world units along the ray
  std::uint32_t kept_ = 0;
};

}  // namespace scolopax::kernel
