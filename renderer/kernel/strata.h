// SPDX-License-Identifier: Apache-2.0
// Lighting of marched rays. The light that a ray absorbs is divided into equal strata. Each stratum is lit at
// one point, where visibility and the shading of every channel are evaluated together. raymarch has 64
// strata, hybrid 8.
#pragma once
#include "renderer/kernel/rng.h"
#include "renderer/kernel/shade.h"
#include "renderer/kernel/shadow_rays.h"

namespace scolopax::kernel {

/// Place, in [0,1], up to which a segment of optical depth `depth` absorbs the share `share` of all that it
/// absorbs. `centre` is the mean place of its extinction, which is taken to be linear.
template <class Float>
SCOLOPAX_LANES Float placeOfAbsorption(Float depth, Float centre, Float share) {
  // In homogeneous matter, 1 - exp(-depth x) = share (1 - exp(-depth)).
  const auto thick = depth >= 1e-3f;
  const Float y = select(thick, opticalDepth(share * absorbed(depth)) / maximum(depth, 1e-3f), share);
  // With an extinction of 1 + k (2 x - 1), x + k (x^2 - x) = y.
  const Float k = clamp(6.0f * centre - 3.0f, -1.0f, 1.0f), base = 1.0f - k;
  return minimum(2.0f * y / maximum(base + squareRoot(maximum(base * base + 4.0f * k * y, 0.0f)), 1e-6f),
                 1.0f);
}

/// The point of each ray at which a stratum is lit, and the channels there.
template <class L>
struct StratumPoints {
  using Float = typename L::Float;
  Float mass;                        ///< what the stratum absorbs of the ray's light
  typename L::Vec emission;          ///< emission of the whole stratum, without lighting
  Float t, offset;                   ///< the point, world units along the ray; the jitter of its shadow rays
  typename L::Word kept;             ///< bit n: channel n is present at the point
  typename L::Vec radiance;          ///< radiance of a unit of absorbed light there, without lighting
  Float share[kMaxVisibleChannels];  ///< each channel's share of the extinction
  typename L::Vec color[kMaxVisibleChannels];
};

/// Computes the lit radiance of a unit of absorbed light at such points, for lanes in `which`. `surface`: the
/// surface on which the points lie, if any.
template <class Steps, class L, class Blend, class View>
SCOLOPAX_LANES_APART void findLight(const View& scene, const Blend& blend, const RayOf<L>& ray,
                                    std::uint32_t channels, const StratumPoints<L>& points,
                                    const SurfaceStart<L>& surface, const typename L::Mask& which,
                                    const ShadowMemory<L, Steps, Blend, View>& ofShadows, CostOf<L>* cost,
                                    typename L::Vec* radiance) {
  using Vec = typename L::Vec;
  const LitPoint<L> hit{ray, points.t, insideOf<L>(scene.clip, ray.origin + points.t * ray.direction)};

  const Visibility<L> visibility = visibilityAt(
      scene, hit, which, [&](const RayOf<L>& shadow, const IntervalOf<L>& part) SCOLOPAX_LANES_LAMBDA {
        return marchTransmittance<L, Steps>(scene, blend, shadow, part, channels, points.offset, surface,
                                            ofShadows, cost);
      });
  const typename L::Mask onSurface = surface.channel > typename L::Int(-1);
  Vec sum(0.0f);
  for (int n = 0; n < scene.channelCount; ++n) {
    const typename L::Mask here = which & hasBit(points.kept, n);
    if (!any(here)) continue;
    const Vec light = points.share[n] *
                      lit(scene, scene.channels[n], points.color[n], hit, visibility, here, onSurface, cost);
    sum = select(here, sum + light, sum);
  }
  *radiance = sum;
}

/// A stratum whose point has been lit.
struct LitStratum {
  glm::vec3 light;     ///< lit radiance of a unit of absorbed light at the point
  glm::vec3 radiance;  ///< the same without lighting
  glm::vec3 emission;  ///< emission of the whole stratum, without lighting
  float mass;          ///< what the stratum absorbs of the ray's light
};

/// Sums the lit strata of a ray, with a control variate. The emission of a stratum is multiplied by the
/// factor by which lighting changes the radiance of a neighbouring stratum, and the stratum's own point
/// corrects the result. The factor must not depend on the point that corrects it. The noise is then that of
/// changes in lighting between strata, not that of the emission.
class StrataSum {
 public:
  SCOLOPAX_HD void add(const LitStratum& lit, glm::vec3& color) {
    glm::vec3 factor(1.0f);
    for (int c = 0; c < 3; ++c)  // capped, as a highlight may be much brighter than the unlit radiance
      if (lit.radiance[c] > kLeastNormal) factor[c] = minimum(lit.light[c] / lit.radiance[c], 2.0f);
    if (count_ == 0) {
      first_ = lit;  // waits for the factor of its neighbour
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

/// Lights the strata [j, j + 1) / K of a ray's light, front to back, with their ends moved to the ends of
/// segments. Each stratum is lit at one point, in a segment drawn with probability proportional to what it
/// absorbs. The random numbers depend only on the sample and on j, so that pictures with different steps
/// light nearly the same points.
///
/// The mass of a stratum is known only at its end, and keeping every segment until then would take too much
/// memory. So this is weighted reservoir sampling, with a reservoir of one: the candidate points of stratum j
/// are at the records u1, u1 u2, u1 u2 u3, ... of a unit interval, with u uniform. The largest record that is
/// at most m is uniform in [0, m), whatever m is (the records of a Poisson process are scale-free). When
/// absorption passes a record, the point moves on to that record's segment.
///
/// With one lane, strata are lit as they end. With many, they wait until there is one for every lane.
template <class Steps, class L, class Blend, class View>
class Strata {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;
  using OfShadows = ShadowMemory<L, Steps, Blend, View>;
  /// Arrays indexed by variables, apart from the rest as in SegmentEnds.
  struct Memory {
    PartOf<L> parts[kMaxVisibleChannels];  ///< per channel, of the current segment
    StratumPoints<L> points;
    struct Waiting {
      StratumPoints<L> points;
      Int ray;
      StrataSum sums[L::kLanes];  ///< per ray, like the colours
      glm::vec3 color[L::kLanes];
    };
    struct Nothing {};
    std::conditional_t<L::kLanes == 1, Nothing, Waiting> waiting;
  };

  /// `channels`: bit n is visible channel n. `set` selects the blocks of `sampler` that are used: marches
  /// with different sets draw independent numbers.
  SCOLOPAX_LANES Strata(Memory& memory, const OfShadows& ofShadows, const View& scene, const Blend& blend,
                        const RayOf<L>& ray, std::uint32_t channels, int set, const SamplerOf<L>& sampler,
                        CostOf<L>* cost)
      : memory_(memory),
        ofShadows_(ofShadows),
        scene_(scene),
        blend_(blend),
        ray_(ray),
        channels_(channels),
        perLight_(1.0f / scene.stratum),
        firstBlock_(std::uint32_t(set) * (std::uint32_t(perLight_) + 1)),
        sampler_(sampler),
        cost_(cost) {
    if constexpr (L::kLanes > 1)
      for (int i = 0; i < L::kLanes; ++i) {
        memory.waiting.sums[i] = {};
        memory.waiting.color[i] = glm::vec3(0.0f);
      }
  }

  /// Adds a segment that absorbs [before, after) of the rays' light and, without lighting, emits `emission`.
  /// Its parts are in `memory`, and their extinctions add up to `extinction`. `last`: the rays end with this
  /// segment. The light of completed strata goes into `color`, which is complete after the last segment.
  SCOLOPAX_LANES void absorb(Float before, Float after, bool last, const Segment<L>& segment,
                             Float extinction, const Vec& emission, Vec& color) {
    const Mask on = after > before;
    const Float mass = after - begin_;
    if (any(on)) {
      emission_ = select(on, emission_ + emission, emission_);
      const Mask fresh = on & (next_ == 0.0f);
      if (any(fresh)) draw(fresh);
      // Records lie below the ends of strata. Whether the point moves to the part of a segment beyond the end
      // is drawn separately.
      const Mask beyond = on & (mass > scene_.stratum), moves = without(on, beyond | (mass < next_));
      Float place = select(beyond, shared_ * mass, Float(-1.0f));
      if (any(moves)) place = select(moves, largestRecord(mass, moves), place);
      const Mask here = on & (place >= before - begin_);
      if (any(here)) {
        const Float share = (place - (before - begin_)) / maximum(after - before, kLeastNormal);
        keep(here, segment, extinction, clamp(share, 0.0f, 1.0f));
      }
    }
    const Int reached = truncated(after * perLight_);
    const Mask done = last ? L::everywhere() : on & (reached > index_);
    if (any(done)) {
      light(done & (mass > 0.0f), mass, color);
      index_ = select(done, reached, index_);
      begin_ = select(done, after, begin_);
      next_ = select(done, Float(0.0f), next_);
      emission_ = select(done, Vec(0.0f), emission_);
    }
    if (last) finish(color);
  }

 private:
  SCOLOPAX_LANES void draw(Mask which) {
    const auto random = sampler_.at(Word(firstBlock_) + Word(index_), which);
    cost_->randomBlocks = cost_->randomBlocks + Word(onesOf(which));
    first_ = select(which, uniformOf(random.x) * scene_.stratum, first_);
    chain_ = select(which, random.y, chain_);
    offset_ = select(which, uniformOf(random.z), offset_);
    shared_ = select(which, uniformOf(hashOf(random.z)), shared_);
  }

  /// Largest record of the stratum that is at most `mass`. Sets next_ to the record above it.
  SCOLOPAX_LANES Float largestRecord(Float mass, Mask which) {
    Float record = first_, next(kInfinity);
    Word chain = chain_;
    for (;;) {
      const Mask above = which & (record > mass);
      if (!any(above)) break;
      next = select(above, record, next);
      record = select(above, record * uniformOf(chain), record);
      chain = select(above, hashOf(chain + 0x9e3779b9u), chain);
    }
    next_ = select(which, next, next_);
    return record;
  }

  /// Moves the stratum's point to the place in the segment up to which it absorbs `share` of its light.
  SCOLOPAX_LANES void keep(Mask which, const Segment<L>& segment, Float extinction, Float share) {
    StratumPoints<L>& points = memory_.points;
    Float opacity(0.0f), moment(0.0f);
    kept_ = select(which, Word(0u), kept_);
    radiance_ = select(which, Vec(0.0f), radiance_);
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(segment.channels >> n & 1)) continue;
      const PartOf<L>& own = memory_.parts[n];
      opacity = opacity + own.opacity;
      moment = moment + own.moment;
      const Mask seen = which & (own.opacity > kLeastNormal);  // else its colour might be NaN
      if (!any(seen)) continue;
      kept_ = kept_ | where(seen, Word(1u << n));
      points.share[n] = select(seen, own.opacity / extinction, points.share[n]);
      points.color[n] = select(seen, own.emission * (1.0f / own.opacity), points.color[n]);
      radiance_ = select(seen, radiance_ + points.color[n] * points.share[n], radiance_);
    }
    const Float length = segment.length();
    const Float place = segment.start + length * placeOfAbsorption(extinction * length,
                                                                   minimum(moment / opacity, 1.0f), share);
    t_ = select(which, place, t_);
  }

  /// Lights the strata of the rays in `which`, or queues them.
  SCOLOPAX_LANES void light(Mask which, Float mass, Vec& color) {
    StratumPoints<L>& points = memory_.points;
    points.mass = mass;
    points.t = t_;
    points.offset = offset_;
    points.kept = kept_;
    points.radiance = radiance_;
    points.emission = emission_;
    if constexpr (L::kLanes == 1) {
      if (which) {
        Vec lit;
        findLight<Steps, L>(scene_, blend_, ray_, channels_, points, {}, which, ofShadows_, cost_, &lit);
        sum_.add({lit, radiance_, emission_, mass}, color);
      }
    } else {
      for (unsigned left = bitsOf(which); left != 0; left &= left - 1) {
        if (count_ == L::kLanes) shine();
        const int i = lowestBit(left), slot = count_++;
        StratumPoints<L>& waiting = memory_.waiting.points;
        put(i, slot, &memory_.waiting.ray);
        put(at(mass, i), slot, &waiting.mass);
        put(at(t_, i), slot, &waiting.t);
        put(at(offset_, i), slot, &waiting.offset);
        const std::int32_t kept = at(kept_, i);
        put(kept, slot, &waiting.kept);
        for (int c = 0; c < 3; ++c) {
          put(at(radiance_[c], i), slot, &waiting.radiance[c]);
          put(at(emission_[c], i), slot, &waiting.emission[c]);
        }
        for (std::uint32_t bits = std::uint32_t(kept); bits != 0; bits &= bits - 1) {
          const int n = lowestBit(bits);
          put(at(points.share[n], i), slot, &waiting.share[n]);
          for (int c = 0; c < 3; ++c) put(at(points.color[n][c], i), slot, &waiting.color[n][c]);
        }
      }
    }
  }

  /// Lights the queued strata, in the order in which they were added.
  SCOLOPAX_LANES_APART void shine() {
    auto& waiting = memory_.waiting;
    const Int ray = waiting.ray;
    RayOf<L> rays;
    for (int axis = 0; axis < 3; ++axis) {
      rays.origin[axis] = permuted(ray_.origin[axis], ray);
      rays.direction[axis] = permuted(ray_.direction[axis], ray);
    }
    CostOf<L> spent{};
    Vec sum;
    findLight<Steps, L>(scene_, blend_, rays, channels_, waiting.points, {}, Int(count_) > L::laneNumbers(),
                        ofShadows_, &spent, &sum);
    for (int i = 0; i < count_; ++i) {
      const int to = at(ray, i);
      const Mask lane = L::laneNumbers() == Int(to);
      const auto of = [i](const Vec& v)
                          SCOLOPAX_LANES_LAMBDA { return glm::vec3(at(v[0], i), at(v[1], i), at(v[2], i)); };
      waiting.sums[to].add(
          {of(sum), of(waiting.points.radiance), of(waiting.points.emission), at(waiting.points.mass, i)},
          waiting.color[to]);
      cost_->fetches = cost_->fetches + where(lane, Int(at(spent.fetches, i)));
      cost_->cellSteps = cost_->cellSteps + where(lane, Int(at(spent.cellSteps, i)));
      cost_->truncated = cost_->truncated + where(lane, Int(at(spent.truncated, i)));
    }
    count_ = 0;
  }

  /// Lights the strata that still wait, and completes `color`.
  SCOLOPAX_LANES void finish(Vec& color) {
    if constexpr (L::kLanes == 1) {
      sum_.finish(color);
    } else {
      if (count_ > 0) shine();
      for (int i = 0; i < L::kLanes; ++i) {
        glm::vec3& own = memory_.waiting.color[i];
        memory_.waiting.sums[i].finish(own);
        for (int c = 0; c < 3; ++c) put(own[c], i, &color[c]);
      }
    }
  }

  Memory& memory_;
  OfShadows ofShadows_;
  const View& scene_;
  const Blend& blend_;
  const RayOf<L>& ray_;
  std::uint32_t channels_;
  float perLight_;  // strata per ray; a power of two
  std::uint32_t firstBlock_;
  const SamplerOf<L>& sampler_;
  CostOf<L>* cost_;
  Int index_{0};
  Float begin_{0.0f};  // start of the stratum, in absorbed light
  Float next_{0.0f};   // record at which the point moves on; 0: none has been drawn
  Float first_{0.0f}, offset_{0.0f}, shared_{0.0f};
  Word chain_{0u};
  Float t_{0.0f};  // the point, world units along the ray
  Word kept_{0u};
  Vec radiance_{0.0f};  // radiance there, without lighting
  Vec emission_{0.0f};  // emission of the whole stratum, without lighting
  std::conditional_t<L::kLanes == 1, StrataSum, typename Memory::Nothing> sum_;
  int count_ = 0;  // strata that wait
};

}  // namespace scolopax::kernel
