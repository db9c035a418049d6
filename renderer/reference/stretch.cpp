// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/stretch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace scolopax::reference {
namespace {

/// The difference of two channels' extinctions between two cuts, w in [0,1].
struct Difference {
  const ChannelInCell &a, &b;
  double begin, end;
  double uOf(double w) const { return begin + w * (end - begin); }
  double operator()(double w) const { return a.at(uOf(w)).extinction - b.at(uOf(w)).extinction; }
};

/// Values at w = 0, 1/3, 2/3 and 1.
using FourValues = std::array<double, 4>;

/// Points, ascending from 0 to 1, between which the difference d = a - b has no extremum. Exact where d is a
/// cubic; where it is bent, the ends of sixteen equal steps are added. None if d is a cubic of one sign
/// throughout.
std::vector<double> bracketEnds(const FourValues& a, const FourValues& b, bool bent) {
  const double d0 = a[0] - b[0], d1 = a[1] - b[1], d2 = a[2] - b[2], d3 = a[3] - b[3];
  const double c1 = (-11 * d0 + 18 * d1 - 9 * d2 + 2 * d3) / 2,
               c2 = (18 * d0 - 45 * d1 + 36 * d2 - 9 * d3) / 2,
               c3 = (-9 * d0 + 27 * d1 - 27 * d2 + 9 * d3) / 2;
  const auto [least, most] = std::minmax({d0, d0 + c1 / 3, d0 + (2 * c1 + c2) / 3, d3});  // Bernstein hull
  if (!bent && (least > 0 || most < 0)) return {};
  std::vector<double> ends{0, 1};
  const double discriminant = c2 * c2 - 3 * c1 * c3;
  if (discriminant > 0) {
    const double q = -(c2 + std::copysign(std::sqrt(discriminant), c2));
    for (const double root : {q / (3 * c3), c1 / q})  // one may be infinite or NaN: then it is not inside
      if (root > 0 && root < 1) ends.push_back(root);
  }
  if (bent)
    for (int i = 1; i < 16; ++i) ends.push_back(i / 16.0);
  std::sort(ends.begin(), ends.end());
  return ends;
}

double bisect(const Difference& difference, double begin, double end) {
  const bool positive = difference(begin) > 0;
  for (;;) {
    const double middle = 0.5 * (begin + end);
    if (middle <= begin || middle >= end) return middle;
    ((difference(middle) > 0) == positive ? begin : end) = middle;
  }
}

/// Appends every u between two neighbouring cuts at which the largest extinction passes from one channel to
/// another.
void appendHandovers(const Stretch& stretch, double begin, double end, std::vector<double>& cuts) {
  const auto& channels = stretch.channels;
  std::array<FourValues, kMaxChannels> extinctions;
  for (std::size_t n = 0; n < channels.size(); ++n)
    for (std::size_t k = 0; k < 4; ++k)
      extinctions[n][k] = channels[n].at(begin + double(k) / 3 * (end - begin)).extinction;
  for (std::size_t i = 0; i < channels.size(); ++i)
    for (std::size_t j = i + 1; j < channels.size(); ++j) {
      const Difference difference{channels[i], channels[j], begin, end};
      double last = 0, lastSign = 0;  // the last point at which the channels differed
      const bool bent = channels[i].channel->bent || channels[j].channel->bent;
      for (const double w : bracketEnds(extinctions[i], extinctions[j], bent)) {
        const double d = difference(w);
        if (std::abs(d) <= kEqualExtinction * channels[i].at(difference.uOf(w)).extinction) continue;
        if (d * lastSign < 0) {
          const double u = difference.uOf(bisect(difference, last, w));
          const double shared = channels[i].at(u).extinction * (1 + 1e-9);
          if (std::none_of(channels.begin(), channels.end(),
                           [&](const ChannelInCell& c) { return c.at(u).extinction > shared; }))
            cuts.push_back(u);
        }
        last = w;
        lastSign = d > 0 ? 1 : -1;
      }
    }
}

}  // namespace

void forEachSmoothPart(const RayCells& ray, const glm::ivec3& dims, const Clipping& clipping, BlendMode blend,
                       std::span<const ActiveChannel> channels,
                       const std::function<bool(const Stretch&, double begin, double end)>& visit) {
  const bool handovers = blend == BlendMode::max || blend == BlendMode::mix;
  Stretch stretch;
  std::vector<double> knots, cuts;
  for (std::size_t i = 0; i + 1 < ray.cuts.size(); ++i) {
    const double begin = ray.cuts[i], end = ray.cuts[i + 1];
    if (!(begin < end)) continue;
    const CellOnRay part(ray, begin, end, dims);
    stretch.start = begin;
    stretch.length = end - begin;
    stretch.begin = ray.origin + begin * ray.direction;
    stretch.end = ray.origin + end * ray.direction;
    stretch.channels.clear();
    knots = {0, 1};
    for (const ActiveChannel& channel : channels) {
      if (!clipping.keeps(channel.number, part.middle)) continue;
      const auto scalar = scalarAlong(channel.field, part);
      if (!scalar) continue;
      ChannelInCell here{&channel, *scalar};
      if (channel.factor) {
        if (!channel.curves.visibleBetween(here.scalar.lower(), here.scalar.upper())) continue;
        here.factor = channel.factor->along(channel.field, stretch.begin, stretch.end);
        if (!here.factor) continue;
        here.factor->appendCuts(knots);
      }
      for (const double value : channel.curves.breakpoints()) here.scalar.appendCrossings(value, knots);
      stretch.channels.push_back(here);
    }
    std::sort(knots.begin(), knots.end());
    for (std::size_t j = 0; j + 1 < knots.size(); ++j) {
      if (!(knots[j] < knots[j + 1])) continue;
      for (ChannelInCell& channel : stretch.channels) {
        const ChannelCurves& curves = channel.channel->curves;
        const double inside = 0.5 * (knots[j] + knots[j + 1]);
        channel.piece = curves.pieceAt(curves.position(channel.scalar(inside)));
        if (channel.factor) channel.factor->choosePieceAt(inside);
      }
      cuts = {knots[j], knots[j + 1]};
      if (handovers) appendHandovers(stretch, knots[j], knots[j + 1], cuts);
      std::sort(cuts.begin(), cuts.end());
      for (std::size_t k = 0; k + 1 < cuts.size(); ++k)
        if (cuts[k] < cuts[k + 1] && !visit(stretch, cuts[k], cuts[k + 1])) return;
    }
  }
}

}  // namespace scolopax::reference
