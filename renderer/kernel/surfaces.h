// SPDX-License-Identifier: Apache-2.0
// Surfaces on which a channel's scalar has a given value. Along a ray, in a cell of eight voxels, a scalar is
// a cubic, so that its surfaces are met at the cubic's roots.
#pragma once
#include <new>
#include <optional>

#include "renderer/kernel/voxel_walk.h"

namespace scolopax::kernel {

/// The surface at which a ray begins, if any. It does not meet that surface again there.
template <class L>
struct SurfaceStart {
  typename L::Int channel{-1};  ///< visible channel, or -1
  typename L::Float value{0.0f};
};

/// Maximum number of surfaces that a ray meets. A ray with more ends there and counts as truncated. Each may
/// be lit by shadow rays to all lights, and behind so many there is only noise.
inline constexpr int kMaxSurfaceHits = 512;

/// A surface that a ray meets.
template <class L>
struct SurfaceHit {
  typename L::Float t{kInfinity};  ///< world units along the ray; infinite: no surface
  typename L::Float opacity{0.0f};
  typename L::Vec color{0.0f};
  SurfaceStart<L> surface;
};

/// Finds the surfaces along rays, front to back; of coincident ones, that of the lowest channel first.
///
/// A ray crosses a surface where the scalar changes between at least the value and below it. Which of the two
/// holds is carried from cell to cell and changes only at crossings, so that none is met twice or missed at a
/// face between cells, however the scalar there is rounded.
template <class L>
class SurfaceWalk {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;

  /// `channels`: bit n is visible channel n.
  SCOLOPAX_LANES SurfaceWalk(const SceneView& scene, const RayOf<L>& rays, const IntervalOf<L>& inside,
                             std::uint32_t channels, const SurfaceStart<L>& start, CostOf<L>* cost)
      : scene_(scene),
        rays_(rays),
        enter_(inside.enter),
        channels_(channels),
        start_(start),
        cost_(cost),
        walk_(scene, scene.surfaceCells, rays, inside, Word(channels), longestIn(scene), cost),
        hit_{Float(kInfinity), Float(0.0f), Vec(0.0f), {Int(-1), Float(0.0f)}} {
    inCell_ = without(L::everywhere(), L::everywhere());
    const glm::vec3 diagonal = scene.worldFromVoxel * glm::vec3(scene.dims);
    const float extent = squareRoot(dot(diagonal, diagonal));
    unit_ = maximum(scene.smallestSpacing * maximum(1.0f, extent * kFine), inside.enter * kFine);
    if (scene.hasNearest()) face_ = endOfFace();
  }

  /// Moves the rays in `which` to their next surfaces.
  SCOLOPAX_LANES void advance(Mask which) {
    hit_.t = select(which, Float(kInfinity), hit_.t);
    for (Mask seeking = which; any(seeking);) {
      const Mask fresh = without(seeking, inCell_);
      if (any(fresh)) {
        enterCells(fresh);
        seeking = seeking & inCell_;
      }
      const Mask crosses = cross(seeking);
      inCell_ = without(inCell_, without(seeking, crosses));
      const Mask kept = without(isKept(crosses), isWhereItBegins(crosses));
      hit_.t = select(without(crosses, kept), Float(kInfinity), hit_.t);
      seeking = without(seeking, kept);
    }
    taken_ = taken_ + onesOf(which);
    const Mask many = which & (taken_ > kMaxSurfaceHits) & (hit_.t < kInfinity);
    cost_->truncated = maximum(cost_->truncated, Word(onesOf(many)));
    hit_.t = select(many, Float(kInfinity), hit_.t);
  }
  SCOLOPAX_LANES const SurfaceHit<L>& hit() const { return hit_; }

 private:
  // Distances, in units: a unit is the smallest spacing, but not less than kFine times the volume's extent or
  // the distance to the eye. If a ray begins within rounding of a value, its side is the one on which it is
  // kSoon further along. If it begins at a surface, others within kSamePlace along the ray are taken to be at
  // the same place. Parts of a ray that are shorter than kLevel are not level. Each is a few times the next,
  // and the last one is above the rounding of points.
  static constexpr float kSoon = 0x1p-9f, kLevel = 0x1p-11f, kSamePlace = 0x1p-13f, kFine = 0x1p-10f;

  /// Longest part of a ray on which scalars are taken to be cubics, in world units. The cubic B-spline is of
  /// degree 9 in a cell: parts of 1/8 spacing are within 4e-5 of the voxels' differences even where voxels
  /// alternate.
  SCOLOPAX_LANES static float longestIn(const SceneView& scene) {
    for (int n = 0; n < scene.channelCount; ++n)
      if (scene.channels[n].surfaceCount > 0 && scene.channels[n].field.has(Filter::cubic))
        return scene.smallestSpacing * 0.125f;
    return kInfinity;
  }

  /// Rounding error of the cubic's values: of interpolation between stored values, of the fit, and of where
  /// the ray meets the faces of cells.
  SCOLOPAX_LANES Float slackOf(const ChannelView& channel, const CubicBounds<L>& bounds) const {
    const float origin = magnitude(channel.origin);
    const Float length = maximum(walk_.end() - walk_.start(), scene_.smallestSpacing * 0.015625f);
    const Float slope = (bounds.upper - bounds.lower) / length;
    return (maximum(bounds.upper, -bounds.lower) + origin) * roundingOf(channel.field.filter) +
           slope * (walk_.end() * 0x1p-21f);
  }

  SCOLOPAX_LANES void enterCells(Mask which) {
    const Float before = walk_.end();
    const Mask has = walk_.next(which);
    const Mask contiguous = has & (walk_.start() == before);
    known_ = select(has, where(contiguous, known_), known_);
    from_ = select(has, Float(-1.0f), from_);
    inCell_ = inCell_ | has;
    const Word wanted = where(has, walk_.active()) & Word(channels_);
    sampleCubics<L>(scene_, rays_, unionOf(wanted), walk_.start(), walk_.end(),
                    [&](int n, const Vec*, const Float* values)
                        SCOLOPAX_LANES_LAMBDA { look(n, values, has & hasBit(wanted, n)); });
    // Of channels that were not sampled, nothing is known at the next cell's face.
    known_ = select(has, known_ & wanted, known_);
  }

  /// Takes channel n's values at the nodes of a cubic, for lanes in `which`.
  SCOLOPAX_LANES void look(int n, const Float* values, Mask which) {
    const ChannelView& channel = scene_.channels[n];
    Float own[kCubicNodes];
    for (int i = 0; i < kCubicNodes; ++i) own[i] = channel.dataFalls ? -values[i] : values[i];
    const Cubic<L> f = cubicThrough<L>(own);
    value_[n] = select<L>(which, f, value_[n]);
    cost_->fetches = cost_->fetches + Word(onesOf(which)) * Word(cubicFetches(channel.field));
    const Mask finite = which & isFinite(f.c0);
    known_ = select(without(which, finite), known_ & Word(~(1u << n)), known_);
    const Mask first = without(finite, hasBit(known_, n));
    if (!any(first)) return;
    const Float atBegin = f.at(Float(-1.0f)), length = walk_.end() - walk_.start();
    const Float way = unit_ * kSoon;
    Float soon = f.at(minimum(2.0f * way / length - 1.0f, 0.0f)), slack = slackOf(channel, boundsOf(f));
    const Mask starts = first & (start_.channel > Int(-1)) & (walk_.start() == enter_);
    const Mask brief = starts | (first & (length < way));  // the cell may be too short to tell
    if (any(brief)) {
      const Vec point = rays_.origin + (walk_.start() + way) * rays_.direction;
      const Float away = sampleStored<L>(channel.field, scene_.dims, point) - channel.origin;
      soon = select(brief & isFinite(away), channel.dataFalls ? -away : away, soon);
      const Float change = magnitude(soon - atBegin) * (kSamePlace / kSoon);
      slack = select(starts, maximum(slack, change), slack);
    }
    Word above(0u);
    for (int i = 0; i < channel.surfaceCount; ++i) {
      const Float value(channel.surfaces[i].value);
      const Mask begins = starts & (start_.channel == Int(n)) & (start_.value == value);
      Mask unclear = begins | ((atBegin >= value - slack) & (atBegin <= value + slack));
      if (channel.field.has(Filter::nearest)) unclear = without(unclear, unclear);
      above = above | where((unclear & (soon >= value)) | without(atBegin >= value, unclear), Word(1u << i));
    }
    above_[n] = select(first, above, above_[n]);
    known_ = select(first, known_ | Word(1u << n), known_);
  }

  /// Finds the next crossing in the cell of each ray in `seeking`. Returns the rays that have one.
  SCOLOPAX_LANES Mask cross(Mask seeking) {
    const Float none(2.0f);
    Float nearest = none;
    Int channel(-1), number(-1);
    for (int n = 0; n < scene_.channelCount; ++n) {
      const ChannelView& own = scene_.channels[n];
      if (own.surfaceCount == 0 || !(channels_ >> n & 1)) continue;
      const Mask here = seeking & hasBit(known_, n);
      if (!any(here)) continue;
      const Cubic<L>& f = value_[n];
      const CubicBounds<L> bounds = boundsOf(f);
      const Float slack = slackOf(own, bounds);
      const Turns<L> turns = turnsOf(f);
      for (int i = 0; i < own.surfaceCount; ++i) {
        const SurfaceView& surface = own.surfaces[i];
        const Mask above = hasBit(above_[n], i);
        const Float value(surface.value);
        const Mask may =
            here & ((above & (bounds.lower < value)) | without(bounds.upper >= value - slack, above));
        if (!any(may)) continue;
        const Float y = crossingAfter(f, turns, value, slack, above, may, none);
        const Mask nearer = y < nearest;
        if (!any(nearer)) continue;
        nearest = select(nearer, y, nearest);
        channel = select(nearer, Int(n), channel);
        number = select(nearer, Int(i), number);
        hit_.opacity = select(nearer, Float(surface.opacity), hit_.opacity);
        hit_.color = select(nearer, Vec(surface.color), hit_.color);
        hit_.surface.channel = select(nearer, Int(n), hit_.surface.channel);
        hit_.surface.value = select(nearer, value, hit_.surface.value);
      }
    }
    const Mask found = nearest < none;
    if (!any(found)) return found;
    from_ = select(found, nearest, from_);
    const Float middle = 0.5f * (walk_.start() + walk_.end()), half = 0.5f * (walk_.end() - walk_.start());
    hit_.t = select(found, clamp(middle + half * nearest, walk_.start(), walk_.end()), hit_.t);
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!any(found & (channel == Int(n)))) continue;
      for (int i = 0; i < scene_.channels[n].surfaceCount; ++i) {
        const Mask crossed = found & (channel == Int(n)) & (number == Int(i));
        above_[n] = above_[n] ^ where(crossed, Word(1u << i));
      }
    }
    return found;
  }

  /// First point at which the cubic changes sides of the value, for lanes in `which`; `none` for others and
  /// if it does not. Between turning points it is monotone, so that the values at their ends decide. An end
  /// within `slack` of the value, as at a face of a cell whose voxels all have it, is inconclusive: the next
  /// interval decides. An interval that has the value throughout, and is not too short, is above it.
  SCOLOPAX_LANES Float crossingAfter(const Cubic<L>& f, const Turns<L>& turns, Float value, Float slack,
                                     Mask above, Mask which, Float none) const {
    const Float ends[] = {turns.first, turns.second, Float(1.0f)};
    const Float half = 0.5f * (walk_.end() - walk_.start());
    const Float least = unit_ * kLevel;
    Float begin = from_, atBegin = f.at(begin), low = begin, high = begin;
    Mask open = which, found = without(which, which), flat = found;
    for (const Float& end : ends) {
      const Mask further = open & (end > begin);
      const Float atEnd = f.at(end);
      const Mask level = (atBegin >= value - slack) & (atEnd >= value - slack) &
                         (f.at(0.5f * (begin + end)) >= value) & (half * (end - begin) > least);
      const Mask rises = without(further, above) & ((atEnd > value + slack) | level);
      const Mask crosses = rises | (further & above & (atEnd < value - slack));
      low = select(crosses, begin, low);
      high = select(crosses, end, high);
      found = found | crosses;
      flat = flat | (rises & (atEnd <= value + slack));
      open = without(open, crosses);
      begin = select(further, end, begin);
      atBegin = select(further, atEnd, atBegin);
    }
    if (!any(found)) return none;
    // The side may also have changed at the face where the cell begins.
    const Float atLow = f.at(low);
    const Mask atOnce = flat | (above & (atLow < value)) | without(atLow >= value, above);
    const Float y = crossing(f, low, high, atLow, f.at(high), value, without(found, atOnce));
    return select(found, select(atOnce, low, y), none);
  }

  /// Whether the channels of hits, in lanes of `which`, are not clipped there.
  SCOLOPAX_LANES Mask isKept(Mask which) const {
    if (!scene_.clip.parts || !any(which)) return which;
    const Word kept = channelsAt<L>(scene_.clip, rays_.origin + hit_.t * rays_.direction);
    Mask found = without(which, which);
    for (int n = 0; n < scene_.channelCount; ++n) {
      found = found | (which & (hit_.surface.channel == Int(n)) & hasBit(kept, n));
    }
    return found;
  }

  /// End of the interval in which a ray that begins on a face between nearest voxels may meet that face
  /// again: rounding may have put its origin on either side of it.
  SCOLOPAX_LANES Float endOfFace() const {
    const int longest = maximum(maximum(scene_.dims.x, scene_.dims.y), scene_.dims.z);
    const float rounding = float(longest) * 0x1p-20f;  // voxels
    Float end(0.0f);
    for (int axis = 0; axis < 3; ++axis) {
      const Float at = rays_.origin[axis] + enter_ * rays_.direction[axis];
      const Float away = at - (toFloat(truncated(at)) + 0.5f);
      const Mask onFace = (away < rounding) & (away > -rounding);
      const Float speed = magnitude(rays_.direction[axis]);
      end = select(onFace, maximum(end, 2.0f * rounding / speed), end);
    }
    // Rays almost along a face are on one of its sides for long.
    return enter_ + minimum(end, scene_.smallestSpacing * 0.0625f);
  }
  /// Whether hits, in lanes of `which`, are at the face between nearest voxels at which their rays begin.
  SCOLOPAX_LANES Mask isWhereItBegins(Mask which) const {
    Mask found = without(which, which);
    if (!scene_.hasNearest() || !any(which)) return found;
    const Mask close = which & (start_.channel > Int(-1)) & (hit_.t <= face_);
    for (int n = 0; n < scene_.channelCount && any(close); ++n)
      if (scene_.channels[n].field.has(Filter::nearest))
        found = found | (close & (hit_.surface.channel == Int(n)));
    return found;
  }

  const SceneView& scene_;
  const RayOf<L>& rays_;
  Float enter_, unit_, face_{0.0f};
  std::uint32_t channels_;
  SurfaceStart<L> start_;
  CostOf<L>* cost_;
  VoxelWalk<L> walk_;
  SurfaceHit<L> hit_;
  Int taken_{0};
  Mask inCell_;        // rays in a cell that may have further crossings
  Float from_{-1.0f};  // crossings up to there are behind
  Word known_{0u};     // bit n: channel n has a value where the ray is, and above_[n] tells its sides
  Cubic<L> value_[kMaxVisibleChannels];
  Word above_[kMaxVisibleChannels];  // bit i: the value is at least that of surface i
};

/// The surfaces along the rays of quadrature. Nothing is done until begin().
template <class L>
class SurfacesAhead {
 public:
  using Mask = typename L::Mask;

  SCOLOPAX_LANES SurfacesAhead() {}
  /// Finds the first surfaces of the rays; arguments as those of SurfaceWalk. Call before the others.
  SCOLOPAX_LANES_RARE void begin(const SceneView& scene, const RayOf<L>& rays, const IntervalOf<L>& inside,
                                 std::uint32_t channels, CostOf<L>* cost) {
    new (&walk_) SurfaceWalk<L>(scene, rays, inside, channels, {}, cost);
    walk_.advance(inside.enter < inside.exit);
  }
  SCOLOPAX_LANES_RARE void advance(const Mask& which) { walk_.advance(which); }
  SCOLOPAX_LANES const SurfaceHit<L>& hit() const { return walk_.hit(); }

 private:
  union {
    SurfaceWalk<L> walk_;
  };
};

/// Multiplies `*transmittance` by that of the surfaces along rays. Rays end where it falls to `least`.
template <class L>
SCOLOPAX_LANES_RARE void passSurfaces(const SceneView& scene, const RayOf<L>& rays,
                                      const IntervalOf<L>& inside, std::uint32_t channels,
                                      const SurfaceStart<L>& start, float least, CostOf<L>* cost,
                                      typename L::Float* transmittance) {
  SurfaceWalk<L> walk(scene, rays, inside, channels, start, cost);
  for (typename L::Mask on = inside.enter < inside.exit;;) {
    walk.advance(on);
    on = on & (walk.hit().t < kInfinity);
    if (!any(on)) return;
    *transmittance = select(on, *transmittance * (1.0f - walk.hit().opacity), *transmittance);
    on = on & (*transmittance > least);
  }
}

/// The surface at which a tracker's ray ends: the one where the opacity of all surfaces passed so far exceeds
/// `number`, uniform in [0,1); none if it passes through all of them.
SCOLOPAX_RARE inline std::optional<SurfaceHit<One>> endAtSurface(const SceneView& scene, const Ray& ray,
                                                                 const IntervalOf<One>& inside,
                                                                 std::uint32_t channels,
                                                                 const SurfaceStart<One>& start, float number,
                                                                 SampleCost* cost) {
  SurfaceWalk<One> walk(scene, ray, inside, channels, start, cost);
  float opacity = 0.0f, transmittance = 1.0f;
  for (;;) {
    walk.advance(true);
    const SurfaceHit<One>& hit = walk.hit();
    if (!(hit.t < kInfinity)) return std::nullopt;
    opacity += transmittance * hit.opacity;
    transmittance *= 1.0f - hit.opacity;
    if (opacity > number || transmittance == 0.0f) return hit;
  }
}

}  // namespace scolopax::kernel
