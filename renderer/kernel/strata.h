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

/// Mean place, in [0,1], of what a segment absorbs. `centre` is that of its extinction; the thicker the
/// segment the further in front: in equal matter the mean is 1 / depth - 1 / (exp(depth) - 1).
SCOLOPAX_HD inline float placeOfAbsorption(float depth, float centre) {
  if (depth < 0.25f) return centre * (1.0f - depth * 0.166666667f);
  const float alpha = absorbed(depth);
  return centre * (2.0f / depth - 2.0f * (1.0f - alpha) / alpha);
}

/// The channels at the place where a stratum will be lit; apart from the rest as SegmentRun is.
struct StratumChannels {
  float share[kMaxVisibleChannels];  ///< of the extinction
  glm::vec3 color[kMaxVisibleChannels];
};

/// A stratum once its place is lit.
struct LitStratum {
  glm::vec3 light;     ///< of a unit of absorbed light at the place
  glm::vec3 radiance;  ///< the same without lights
  glm::vec3 emission;  ///< of the whole stratum, without lights
  float mass;          ///< what it absorbs of the ray's light
};

/// Sums up a ray's lit strata. What light makes of a stratum's emission is taken to be what it made of a
/// neighbour's, and the stratum's own place corrects that (a control variate, whose factor must not depend on
/// the place that it corrects). So the noise is that of the light's changes, not of the emission's.
class StrataSum {
 public:
  SCOLOPAX_HD void add(const LitStratum& lit, glm::vec3& color) {
    glm::vec3 factor(1.0f);
    for (int c = 0; c < 3; ++c)  // highlights may be brighter than anything that their matter sends out
      if (lit.radiance[c] > kLeastNormal) factor[c] = minimum(lit.light[c] / lit.radiance[c], 2.0f);
    if (count_ == 0) {
      first_ = lit;  // waits for its neighbour
    } else {
      if (count_ == 1) color += corrected(first_, factor);
      color += corrected(lit, factor_);
    }
    factor_ = factor;
    count_ = count_ < 2 ? count_ + 1 : count_;
  }
  SCOLOPAX_HD void finish(glm::vec3& color) const {
    if (count_ == 1) color += corrected(first_, glm::vec3(1.0f));
  }

 private:
  SCOLOPAX_HD static glm::vec3 corrected(const LitStratum& lit, glm::vec3 factor) {
    return lit.mass * (lit.light - factor * lit.radiance) + factor * lit.emission;
  }
  glm::vec3 factor_{1.0f};
  LitStratum first_{};
  int count_ = 0;
};

/// Lights the strata [j, j + 1) / K of a ray's light, front to back, their ends moved to the ends of
/// segments: each at one place, in a segment that is drawn in proportion to what it absorbs, with random
/// numbers that depend on the sample and on j alone. Pictures of different steps so light nearly the same
/// places.
///
/// How much a stratum holds is known only at its end, and remembering all that may be lit is out of the
/// question. So the places of stratum j are the records u1, u1 u2, u1 u2 u3, ... of a unit interval, u
/// uniform: the largest that is at most m is uniform in [0, m), whatever m is (the records of a Poisson
/// process are scale-free). As absorption passes a record, the place moves on to it.
template <class Blend, class Features>
class Strata {
 public:
  SCOLOPAX_HD Strata(StratumChannels& channels, const SceneView& scene, const Ray& ray, int only,
                     const Sampler& sampler, SampleCost* cost)
      : channels_(channels), scene_(scene), ray_(ray), only_(only), sampler_(sampler), cost_(cost) {}

  /// Takes a segment that absorbs [before, after) of the ray's light and without lights would send out
  /// `emission` of it; `last` if the ray ends with it. Adds the light of the strata that are complete to
  /// `color`.
  SCOLOPAX_HD void absorb(float before, float after, bool last, const AbsorbingSegment& segment,
                          const SegmentParts<Blend>& parts, glm::vec3 emission, glm::vec3& color) {
    const float mass = after - begin_;
    if (after > before) {
      emission_ += emission;
      if (next_ == 0.0f) draw();
      // Records lie below the ends of strata; the part of a segment beyond is drawn apart.
      const float place = mass > scene_.stratum ? shared_ * mass : mass < next_ ? -1.0f : largestRecord(mass);
      if (place >= before - begin_) keep(segment, parts);
    }
    const int reached = int(after / scene_.stratum);
    if (reached > index_ || last) {
      if (mass > 0.0f) sum_.add({light(), radiance_, emission_, mass}, color);
      index_ = reached;
      begin_ = after;
      next_ = 0.0f;
      emission_ = glm::vec3(0.0f);
    }
    if (last) sum_.finish(color);
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

  SCOLOPAX_HD void keep(const AbsorbingSegment& segment, const SegmentParts<Blend>& parts) {
    float opacity = 0.0f, moment = 0.0f;
    kept_ = 0;
    radiance_ = glm::vec3(0.0f);
    parts.visit([&](int n, const Part& own) {
      opacity += own.opacity;
      moment += own.moment;
      if (!(own.opacity > kLeastNormal)) return;  // its colour would not be a number
      kept_ |= 1u << n;
      channels_.share[n] = own.opacity / segment.extinction;
      channels_.color[n] = own.emission * (1.0f / own.opacity);
      radiance_ += channels_.share[n] * channels_.color[n];
    });
    place_ = segment.start + segment.length * placeOfAbsorption(segment.extinction * segment.length,
                                                                minimum(moment / opacity, 1.0f));
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
  glm::vec3 radiance_{0.0f};  // there, without lights
  glm::vec3 emission_{0.0f};  // of all of the stratum, without lights
  StrataSum sum_;
};

}  // namespace scolopax::kernel
