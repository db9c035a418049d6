// SPDX-License-Identifier: Apache-2.0
// The classifier of channels whose opacity, given by a curve of the value, is multiplied by a factor, given
// by a curve of |gradient|. Functions that only such channels need are not inlined and do not take the scene
// as a parameter: passing its address would force it into memory.
#pragma once
#include "renderer/kernel/classifiers/curve.h"

namespace scolopax::kernel {

/// Position of |gradient|, in stored values per smallest spacing, on the factor's curve.
SCOLOPAX_HD inline float factorPosition(const GradientFactorView& factor, float magnitude) {
  return clamp((magnitude - factor.origin) * factor.scale + factor.offset, 0.0f, 1.0f);
}

/// Largest gradient factor for |gradient| from lo to hi, in stored values per smallest spacing.
SCOLOPAX_HD inline float largestFactor(const GradientFactorView& factor, float lo, float hi) {
  return largestBetween(factor.curve, factorPosition(factor, lo), factorPosition(factor, hi));
}

/// Position of |gradient| on the factor's curve. It may lie outside [0,1], like that of stretchPosition() in
/// optical_curve.h. NaN where the gradient is not finite.
template <class L>
SCOLOPAX_LANES_RARE void findFactorPosition(const ChannelView& channel, glm::ivec3 dims,
                                            const typename L::Vec& point, typename L::Float* position) {
  using Float = typename L::Float;
  const GradientFactorView& factor = channel.factor;
  const Gradient<L> gradient = gradientAt<L>(channel.field, dims, factor.fromVoxel, point);
  const Float unbounded = (lengthOf<L>(gradient.perSpacing) - factor.origin) * factor.scale + factor.offset;
  *position = select(gradient.finite, clamp(unbounded, -kFarPosition, kFarPosition), Float(kNaN));
}

/// Factor of the opacity at a point; 0 where the gradient is not finite.
SCOLOPAX_RARE inline float gradientFactorAt(const ChannelView& channel, glm::ivec3 dims, glm::vec3 point) {
  const GradientFactorView& factor = channel.factor;
  const Gradient<One> gradient = gradientAt<One>(channel.field, dims, factor.fromVoxel, point);
  if (!gradient.finite) return 0.0f;
  return evaluate(factor.curve, factorPosition(factor, lengthOf<One>(gradient.perSpacing)));
}

/// |gradient| in a voxel cell, in stored values per smallest spacing: at a point, and by how much it may
/// change per voxel of distance, summed over the axes.
struct CellGradient {
  float magnitude, change, slack;  ///< slack: what rounding may add
  bool finite;                     ///< the gradient is finite in the cell
};
/// Inside a cell, each component per voxel is an average of slopes between neighbouring voxels along its
/// axis. So a step of one voxel along any axis changes it by at most the spread of those slopes.
SCOLOPAX_RARE inline CellGradient gradientIn(const FieldView& field, glm::ivec3 dims,
                                             const glm::mat3& fromVoxel, glm::ivec3 cell, glm::vec3 point) {
  const VoxelStrides all(field, dims);
  const std::size_t strides[] = {all.x, all.y, all.z};
  glm::vec3 change(0.0f);
  float most = 0.0f;
  bool finite = true;
  const int around = field.has(Filter::cubic) ? 1 : 0, width = 2 + 2 * around;  // voxels across the cell
  visitScalarType(field.type, [&](auto zero) {
    const auto* voxels = static_cast<const decltype(zero)*>(field.voxels) + field.lane;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3, low = cell[axis];
      float least = kInfinity, largest = -kInfinity;
      if (around > 0 && (low == 0 || low + 2 >= dims[axis]))
        least = largest = 0.0f;  // voxels are repeated beyond the border
      for (int edge = low > 0 ? low - 1 : 0; edge <= low + 1 && edge + 1 < dims[axis]; ++edge)
        for (int corner = 0; corner < width * width; ++corner) {
          const int j = cell[u] - around + corner % width, k = cell[v] - around + corner / width;
          if (j < 0 || k < 0 || j >= dims[u] || k >= dims[v]) continue;
          const auto* from = voxels + std::size_t(edge) * strides[axis] + std::size_t(j) * strides[u] +
                             std::size_t(k) * strides[v];
          const float a = float(from[0]), b = float(from[strides[axis]]);
          if (!isFinite(a) || !isFinite(b)) {
            // Beyond the last voxel, differences are one-sided and do not use the edge before the cell.
            finite = finite && around == 0 && edge < low && low + 2 == dims[axis];
            continue;
          }
          least = minimum(least, b - a);
          largest = maximum(largest, b - a);
          most = maximum(most, maximum(magnitude(a), magnitude(b)));
        }
      if (least < largest) change[axis] = largest - least;
    }
  });
  glm::vec3 turned(0.0f);
  float scale = 0.0f, longest = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    longest = maximum(longest, float(dims[axis]));
    const glm::vec3& column = fromVoxel[axis];
    turned += glm::vec3(magnitude(column.x), magnitude(column.y), magnitude(column.z)) * change[axis];
    scale = maximum(scale, sumOfMagnitudes(column));
  }
  const Gradient<One> here = gradientAt<One>(field, dims, fromVoxel, point);
  CellGradient gradient{lengthOf<One>(here.perSpacing), lengthOf<One>(turned), 0.0f, finite};
  // Rounding of values, and of coordinates, which may be as large as the longest side.
  gradient.slack =
      3.0f * scale * most * (2.0f * roundingOf(field.filter)) + gradient.change * longest * 0x1p-22f;
  // If the cell is finite, this happens only on a face, where the gradient uses voxels outside the cell.
  if (!here.finite) gradient.magnitude = 0.0f, gradient.change = kLargestFinite;
  return gradient;
}

namespace detail {
/// As addLinear(), with the opacity multiplied by a factor that changes linearly from `first` to `second`.
/// Exact.
template <Detail kDetail, class L>
SCOLOPAX_LANES void addProduct(const Optical<L>& a, const Optical<L>& b, typename L::Float first,
                               typename L::Float second, typename L::Float s, typename L::Float e,
                               typename L::Mask which, PartOf<L>* means) {
  using Float = typename L::Float;
  // Simpson's rule, exact up to cubics.
  const Float sixth = (e - s) * 0.166666667f;
  const Float left = a.opacity * first, right = b.opacity * second;
  const Float middle = (a.opacity + b.opacity) * (first + second);  // four times the product in the middle
  means->opacity = means->opacity + where(which, sixth * (left + middle + right));
  if constexpr (kDetail >= Detail::emission)
    for (int c = 0; c < 3; ++c)
      means->emission[c] =
          means->emission[c] +
          where(which, sixth * (left * a.color[c] + middle * (0.5f * (a.color[c] + b.color[c])) +
                                right * b.color[c]));
  if constexpr (kDetail >= Detail::moment)
    means->moment = means->moment + where(which, sixth * (left * s + middle * (0.5f * (s + e)) + right * e));
}
}  // namespace detail

/// As meansBetween(), with the opacity multiplied by the curve `factor`, on which the segment goes from g to
/// h.
template <Detail kDetail, class L>
SCOLOPAX_LANES PartOf<L> meansOfProduct(const OpticalCurveView& curve, const CurvePoint<L>& p,
                                        const CurvePoint<L>& q, const OpticalCurveView& factor,
                                        const CurvePoint<L>& g, const CurvePoint<L>& h,
                                        typename L::Mask which) {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;
  PartOf<L> all = noPart<L>();
  const auto addPiece = [&](const Knots<L>& first, const Knots<L>& second, Int piece, Float from, Float to,
                            Float begin, Float end, Mask on) SCOLOPAX_LANES_LAMBDA {
    const Float u = opticalIn<Detail::extinction, L>(first, second, piece, from).opacity;
    const Float v = opticalIn<Detail::extinction, L>(first, second, piece, to).opacity;
    on = on & ((u > 0.0f) | (v > 0.0f));
    if (!any(on)) return;
    const Float width = end - begin, way = q.position - p.position;
    PartOf<L> means = noPart<L>();
    const CurvePoint<L> x0 = pointOn<L>(curve, p.position + begin * way);
    const CurvePoint<L> x1 = pointOn<L>(curve, p.position + end * way);
    forEachPiece<L>(curve, x0, x1, on,
                    [&](const Knots<L>& a, const Knots<L>& b, Int k, Float x, Float y, Float s, Float e,
                        Mask lanes) SCOLOPAX_LANES_LAMBDA {
                      detail::addProduct<kDetail, L>(opticalIn<kDetail, L>(a, b, k, x),
                                                     opticalIn<kDetail, L>(a, b, k, y), u + s * (v - u),
                                                     u + e * (v - u), s, e, lanes, &means);
                    });
    all.opacity = all.opacity + width * means.opacity;
    if constexpr (kDetail >= Detail::emission) all.emission = all.emission + means.emission * width;
    if constexpr (kDetail >= Detail::moment)
      all.moment = all.moment + width * (begin * means.opacity + width * means.moment);
  };
  forEachPiece<L>(factor, g, h, which, addPiece);
  return all;
}

/// Computes CurveTimesCurve::partAlone(). |gradient| is taken to be linear on the segment, too.
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES_RARE void findPartWithFactor(const ChannelView& channel, const SegmentEnds<L, View>& ends,
                                            int n, const typename L::Mask& which, PartOf<L>* part) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  const OpticalCurveView& factor = channel.factor.optical;
  const CurvePoint<L>& from = ends.from.value[n];
  const CurvePoint<L>& to = ends.to.value[n];
  const Float g = ends.from.gradient[n], h = ends.to.gradient[n];
  // An end without a finite value and gradient counts for nothing.
  const Mask known = (from.position == from.position) & isFinite(g);
  const Mask other = (to.position == to.position) & isFinite(h), some = which & (known | other);
  *part = noPart<L>();
  if (!any(some)) return;
  const PartOf<L> means = meansOfProduct<kDetail, L>(
      channel.optical, select(known, from, to), select(other, to, from), factor,
      pointOn<L>(factor, select(known, g, h)), pointOn<L>(factor, select(other, h, g)), some);
  *part = scaled(means, select(known & other, Float(channel.density), Float(0.5f * channel.density)));
}

/// Removes rays from the mask where the gradient factor of channel n may change on the segment.
template <class L, class View>
SCOLOPAX_LANES_RARE void dropWhereFactorChanges(const ChannelView& channel, const SegmentEnds<L, View>& ends,
                                                int n, typename L::Mask* straight) {
  const OpticalCurveView& curve = channel.factor.optical;
  const CurvePoint<L> g = pointOn<L>(curve, ends.from.gradient[n]),
                      h = pointOn<L>(curve, ends.to.gradient[n]);
  *straight = *straight & (g.piece == h.piece) &
              (opticalAt<Detail::extinction, L>(curve, g, L::everywhere()).opacity ==
               opticalAt<Detail::extinction, L>(curve, h, L::everywhere()).opacity);
}

/// Multiplies an opacity of channel n by its gradient factor at a fraction `along` of a segment.
template <class L, class View>
SCOLOPAX_LANES_RARE void multiplyByFactor(const ChannelView& channel, const SegmentEnds<L, View>& ends, int n,
                                          const typename L::Float& along, const typename L::Mask& which,
                                          typename L::Float* opacity) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  const Float from = ends.from.gradient[n], to = ends.to.gradient[n];
  const Mask known = isFinite(from), other = isFinite(to);
  const Float g = select(known, from, to), h = select(other, to, from);
  const OpticalCurveView& curve = channel.factor.optical;
  const CurvePoint<L> point = pointOn<L>(curve, g + along * (h - g));
  const Float factor = opticalAt<Detail::extinction, L>(curve, point, which).opacity;
  *opacity = where(known | other, *opacity * factor);
}

/// As meansOfCubic(), with the gradient factor of the channel, whose position is the cubic `g`.
template <Detail kDetail, class L>
SCOLOPAX_LANES_RARE void findMeansWithFactor(const ChannelView& channel, const Cubic<L>& f, const Cubic<L>& g,
                                             const typename L::Mask& which, PartOf<L>* means) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  const OpticalCurveView& factor = channel.factor.optical;
  const Float begin(-1.0f);
  CurveWalk<L> walk(channel.optical, f, pieceAt<L>(channel, f.at(begin)));
  CurveWalk<L> ofFactor(factor, g, pointOn<L>(factor, g.at(begin)).piece);
  *means = noPart<L>();
  Float from = begin;
  Mask on = which;
  for (int left = 3 * (channel.optical.count + factor.count) + 8; left > 0 && any(on); --left) {
    const Float own = walk.findEnd(from, on), other = ofFactor.findEnd(from, on), to = minimum(own, other);
    addCubicPiece<kDetail, L>(
        from, to, on,
        [&](Float y) SCOLOPAX_LANES_LAMBDA {
          Optical<L> optical = walk.template opticalAt<kDetail>(positionAt<L>(channel, f.at(y)));
          optical.opacity =
              optical.opacity * ofFactor.template opticalAt<Detail::extinction>(g.at(y)).opacity;
          return optical;
        },
        means);
    const Mask meets = walk.moveTo(to, own <= other, on) | ofFactor.moveTo(to, other <= own, on);
    from = select(on, to, from);
    on = without(on, without(from >= 1.0f, meets));
  }
}

/// Multiplies an opacity by the gradient factor at a position.
template <class L>
SCOLOPAX_LANES_RARE void multiplyByFactorAt(const ChannelView& channel, const typename L::Float& position,
                                            const typename L::Mask& which, typename L::Float* opacity) {
  const OpticalCurveView& curve = channel.factor.optical;
  *opacity = *opacity * opticalAt<Detail::extinction, L>(curve, pointOn<L>(curve, position), which).opacity;
}

/// classifiers.h says what each function does.
struct CurveTimesCurve {
  SCOLOPAX_HD static unsigned fetches(const FieldView& field, glm::ivec3 dims) {
    return gradientFetches(field, dims);
  }

  SCOLOPAX_HD static float extinctionAt(const ChannelView& channel, glm::ivec3 dims, glm::vec3 point,
                                        float position, SampleCost* cost) {
    const float extinction = kernel::extinctionAt(channel, position);
    if (!(extinction > 0.0f)) return extinction;
    cost->fetches += fetches(channel.field, dims);
    return extinction * gradientFactorAt(channel, dims, point);
  }

  struct Nearby : Curve::Nearby {
    SCOLOPAX_HD Nearby(const ChannelView& channel, glm::ivec3 dims, glm::ivec3 cell, glm::vec3 point,
                       glm::vec3 direction)
        : Curve::Nearby(channel, dims, cell, point, direction),
          factor_(channel.factor),
          gradient_(gradientIn(channel.field, dims, channel.factor.fromVoxel, cell, point)) {
      gradient_.change *= sumOfMagnitudes(direction);
    }
    SCOLOPAX_HD bool finite() const { return gradient_.finite; }
    SCOLOPAX_HD float at(float stored) const {
      return Curve::Nearby::at(stored) * largestFactor(factor_, gradient_.magnitude, gradient_.magnitude);
    }
    SCOLOPAX_HD float bound(float lo, float hi, float way) const {
      const float around = gradient_.change * way + gradient_.slack;
      return Curve::Nearby::bound(lo, hi, way) * largestFactor(factor_,
                                                               maximum(gradient_.magnitude - around, 0.0f),
                                                               gradient_.magnitude + around);
    }

   private:
    const GradientFactorView& factor_;
    CellGradient gradient_;
  };

  template <class L, class View>
  SCOLOPAX_LANES static void sample(const ChannelView& channel, glm::ivec3 dims, const typename L::Vec& point,
                                    typename L::Float stored, int n, SegmentEnd<L, View>& end) {
    Curve::sample<L>(channel, dims, point, stored, n, end);
    findFactorPosition<L>(channel, dims, point, &end.gradient[n]);
  }
  template <class L, class View>
  SCOLOPAX_LANES static void passOn(int n, SegmentEnds<L, View>& ends) {
    Curve::passOn(n, ends);
    ends.from.gradient[n] = ends.to.gradient[n];
  }

  template <class L, class View>
  SCOLOPAX_LANES static void sample(const ChannelView& channel, glm::ivec3 dims,
                                    const typename L::Vec* points, const typename L::Float* stored,
                                    typename L::Mask which, int n, SegmentCubics<L, View>& cubics) {
    Curve::sample<L>(channel, dims, points, stored, which, n, cubics);
    typename L::Float positions[kCubicNodes];
    for (int i = 0; i < kCubicNodes; ++i) findFactorPosition<L>(channel, dims, points[i], &positions[i]);
    cubics.gradient[n] = select<L>(which, cubicThrough<L>(positions), cubics.gradient[n]);
  }
  template <class L, class View>
  SCOLOPAX_LANES static void cutPart(const SegmentCubics<L, View>& whole, typename L::Float middle,
                                     typename L::Float half, int n, SegmentCubics<L, View>& part) {
    Curve::cutPart<L>(whole, middle, half, n, part);
    part.gradient[n] = partOf<L>(whole.gradient[n], middle, half);
  }

  template <Detail kDetail, class L, class View>
  SCOLOPAX_LANES static PartOf<L> partAlone(const ChannelView& channel, const SegmentEnds<L, View>& ends,
                                            int n, typename L::Mask which) {
    PartOf<L> part;
    findPartWithFactor<kDetail, L>(channel, ends, n, which, &part);
    return part;
  }
  template <Detail kDetail, class L, class View>
  SCOLOPAX_LANES static PartOf<L> partAlone(const ChannelView& channel, const SegmentCubics<L, View>& cubics,
                                            int n, typename L::Mask which) {
    const Cubic<L>& g = cubics.gradient[n];
    const typename L::Mask seen = Curve::meetsCurve(channel, cubics.value[n], which) & isFinite(g.c0);
    if (!any(seen)) return noPart<L>();
    PartOf<L> means;
    findMeansWithFactor<kDetail, L>(channel, cubics.value[n], g, seen, &means);
    return scaled(means, channel.density);
  }

  template <class L, class View>
  SCOLOPAX_LANES static typename L::Float extinctionOn(const ChannelView& channel,
                                                       const SegmentEnds<L, View>& ends, int n,
                                                       typename L::Float along, typename L::Mask which,
                                                       typename L::Float opacity) {
    auto extinction = Curve::extinctionOn<L>(channel, ends, n, along, which, opacity);
    multiplyByFactor<L>(channel, ends, n, along, which, &extinction);
    return extinction;
  }
  template <class L, class View>
  SCOLOPAX_LANES static typename L::Float extinctionOn(const ChannelView& channel,
                                                       const SegmentCubics<L, View>& cubics, int n,
                                                       typename L::Float along, typename L::Mask which,
                                                       typename L::Float opacity) {
    const Cubic<L>& g = cubics.gradient[n];
    multiplyByFactorAt<L>(channel, g.at(2.0f * along - 1.0f), which, &opacity);
    return where(isFinite(cubics.value[n].c0) & isFinite(g.c0), opacity * channel.density);
  }

  template <class L, class View>
  SCOLOPAX_LANES static typename L::Mask isStraight(const ChannelView& channel,
                                                    const SegmentEnds<L, View>& ends, int n) {
    auto straight = Curve::isStraight<L>(channel, ends, n);
    dropWhereFactorChanges<L>(channel, ends, n, &straight);
    return straight;
  }
  template <class L, class View>
  SCOLOPAX_LANES static typename L::Mask isStraight(const ChannelView& channel,
                                                    const SegmentCubics<L, View>& cubics, int n) {
    return Curve::isStraight<L>(channel, cubics, n);
  }
};

}  // namespace scolopax::kernel
