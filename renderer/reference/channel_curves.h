// SPDX-License-Identifier: Apache-2.0
// The mapping from a scalar to extinction and colour, in double, for the reference integrator; and the
// scalars at which it has a kink or a jump, so that the integrator can cut a ray there.
#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "renderer/data/scene.h"

namespace scolopax::reference {

/// Extinction and colour of one channel at one point.
struct ChannelSample {
  double extinction;  ///< per world unit
  glm::dvec3 color;   ///< linear RGB
};

class ChannelCurves {
 public:
  /// Throws Error(badInput) for a range, gamma or density that is not finite or out of bounds, or an empty
  /// or descending curve.
  explicit ChannelCurves(const ChannelAppearance& appearance);

  /// Data values between which extinction and colour are smooth, ascending.
  std::span<const double> breakpoints() const { return breakpoints_; }
  /// Position in [0,1] of a data value in the channel's range, after gamma.
  double position(double scalar) const;
  /// Index of the piece, between two neighbouring knots, that contains `position`.
  std::size_t pieceAt(double position) const;
  /// Evaluates piece `piece` at `position`, clamped to the piece's ends, so that a rounding error does not
  /// carry a position to the other side of a jump.
  ChannelSample sample(std::size_t piece, double position) const;
  /// False if no scalar has an extinction above 0.
  bool visible() const { return visible_; }
  /// False if no scalar from `lo` to `hi` has an extinction above 0.
  bool visibleBetween(double lo, double hi) const;
  /// Largest component of any colour.
  double brightest() const { return brightest_; }

 private:
  struct Piece {
    double begin, end;                      // positions
    double extinctionBegin, extinctionEnd;  // limits from inside
    glm::dvec3 colorBegin, colorEnd;
  };
  double lo_, hi_, gamma_;
  bool visible_ = false;
  double brightest_ = 0;
  std::vector<Piece> pieces_;  // the last one is the single position 1
  std::vector<double> breakpoints_;
};

}  // namespace scolopax::reference
