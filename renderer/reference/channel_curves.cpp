// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/channel_curves.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

double valueOf(const OpacityKnot& knot) { return knot.value; }
glm::dvec3 valueOf(const ColorKnot& knot) { return knot.color; }

/// Value of a curve at `position`, interpolated between neighbouring knots; `next` is the first knot after
/// it.
template <class Knot>
auto between(const std::vector<Knot>& knots, typename std::vector<Knot>::const_iterator next,
             double position) {
  if (next == knots.begin()) return valueOf(knots.front());
  if (next == knots.end()) return valueOf(knots.back());
  const Knot &a = *(next - 1), &b = *next;
  return valueOf(a) + (valueOf(b) - valueOf(a)) * ((position - a.position) / (b.position - a.position));
}

/// Limits of a curve as a position is approached from above (the value there) and from below.
template <class Knot>
auto limitFromAbove(const std::vector<Knot>& knots, double position) {
  return between(knots,
                 std::upper_bound(knots.begin(), knots.end(), position,
                                  [](double p, const Knot& knot) { return p < knot.position; }),
                 position);
}
template <class Knot>
auto limitFromBelow(const std::vector<Knot>& knots, double position) {
  return between(knots,
                 std::lower_bound(knots.begin(), knots.end(), position,
                                  [](const Knot& knot, double p) { return knot.position < p; }),
                 position);
}

template <class Knot>
void checkCurve(const std::vector<Knot>& knots, const char* name) {
  const auto ascending = [](const Knot& a, const Knot& b) { return !(b.position >= a.position); };
  if (knots.empty() || std::adjacent_find(knots.begin(), knots.end(), ascending) != knots.end())
    throw Error(ErrorCode::badInput, std::string("reference: ") + name +
                                         " needs at least one knot, with positions that do not decrease");
}

}  // namespace

ChannelCurves::ChannelCurves(const ChannelAppearance& appearance)
    : lo_(appearance.rangeLo), hi_(appearance.rangeHi), gamma_(appearance.gamma) {
  if (!std::isfinite(lo_) || !std::isfinite(hi_) || !std::isfinite(gamma_) || !(gamma_ > 0) ||
      !std::isfinite(appearance.density) || !(appearance.density >= 0))
    throw Error(ErrorCode::badInput, "reference: range, gamma (> 0) and density (>= 0) must be finite");
  checkCurve(appearance.opacity, "opacity");
  checkCurve(appearance.color, "color");

  std::vector<double> positions{0, 1};
  for (const OpacityKnot& knot : appearance.opacity) positions.push_back(std::clamp(knot.position, 0.0, 1.0));
  for (const ColorKnot& knot : appearance.color) positions.push_back(std::clamp(knot.position, 0.0, 1.0));
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());

  for (std::size_t i = 0; i < positions.size(); ++i) {
    Piece piece;
    piece.begin = positions[i];
    piece.extinctionBegin = appearance.density * limitFromAbove(appearance.opacity, piece.begin);
    piece.colorBegin = limitFromAbove(appearance.color, piece.begin);
    if (i + 1 < positions.size()) {
      piece.end = positions[i + 1];
      piece.extinctionEnd = appearance.density * limitFromBelow(appearance.opacity, piece.end);
      piece.colorEnd = limitFromBelow(appearance.color, piece.end);
    } else {
      piece.end = piece.begin;
      piece.extinctionEnd = piece.extinctionBegin;
      piece.colorEnd = piece.colorBegin;
    }
    visible_ = visible_ || piece.extinctionBegin > 0 || piece.extinctionEnd > 0;
    for (const glm::dvec3& c : {piece.colorBegin, piece.colorEnd})
      brightest_ = std::max({brightest_, c.x, c.y, c.z});
    pieces_.push_back(piece);
    breakpoints_.push_back(lo_ + std::pow(piece.begin, 1 / gamma_) * (hi_ - lo_));
  }
  std::sort(breakpoints_.begin(), breakpoints_.end());
  breakpoints_.erase(std::unique(breakpoints_.begin(), breakpoints_.end()), breakpoints_.end());
}

double ChannelCurves::position(double scalar) const {
  if (lo_ == hi_) return scalar < lo_ ? 0 : 1;
  const double p = std::clamp((scalar - lo_) / (hi_ - lo_), 0.0, 1.0);
  return gamma_ == 1 ? p : std::pow(p, gamma_);
}

bool ChannelCurves::visibleBetween(double lo, double hi) const {
  const auto [first, last] = std::minmax({pieceAt(position(lo)), pieceAt(position(hi))});
  for (std::size_t i = first; i <= last; ++i)
    if (pieces_[i].extinctionBegin > 0 || pieces_[i].extinctionEnd > 0) return true;
  return false;
}

std::size_t ChannelCurves::pieceAt(double position) const {
  const auto next = std::upper_bound(pieces_.begin(), pieces_.end(), position,
                                     [](double p, const Piece& piece) { return p < piece.begin; });
  return std::size_t(next - pieces_.begin()) - 1;
}

ChannelSample ChannelCurves::sample(std::size_t piece, double position) const {
  const Piece& p = pieces_[piece];
  const bool slopes = p.end > p.begin && lo_ != hi_;  // an empty range has the positions 0 and 1 only
  const double w = slopes ? std::clamp((position - p.begin) / (p.end - p.begin), 0.0, 1.0) : 0.0;
  return {std::lerp(p.extinctionBegin, p.extinctionEnd, w), p.colorBegin + (p.colorEnd - p.colorBegin) * w};
}

}  // namespace scolopax::reference
