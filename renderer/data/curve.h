// SPDX-License-Identifier: Apache-2.0
// Piecewise-linear curves in the form that kernels evaluate, and the mapping from values to positions on
// them.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/kernel/views/curve_view.h"

namespace scolopax {

/// Owner of one curve's knots; view() borrows.
template <class Value>
struct Curve {
  std::vector<float> positions;
  std::vector<Value> values;
  std::vector<std::uint16_t> buckets;
  kernel::CurveView<Value> view() const {
    return {positions.data(), values.data(), buckets.data(), int(positions.size())};
  }
};

/// Owner of the opacity and colour curves, both given at the knots of either. A knot's stored value equals
/// its position until a TransferFunction sets it.
struct OpticalCurve {
  std::vector<kernel::OpticalKnot> knots;
  std::vector<std::uint16_t> buckets;
  bool jumps = false;
  float first = 0, last = 1;  ///< opacity is 0 at positions <= first and >= last
  kernel::OpticalCurveView view() const {
    return {knots.data(), buckets.data(), int(knots.size()), jumps, first, last};
  }
};

/// Throws Error(badInput), naming the curve, for no knots or more than 4096, positions that decrease or lie
/// outside [0,1], and opacities outside [0,1].
Curve<float> makeCurve(const std::vector<OpacityKnot>& knots, const char* name);
Curve<glm::vec3> makeCurve(const std::vector<ColorKnot>& knots, const char* name);
OpticalCurve makeOpticalCurve(const Curve<float>& opacity, const Curve<glm::vec3>& color);

/// Maps a value to its position on curves over the range from lo to hi: clamp((value - origin) * scale +
/// offset, 0, 1). If lo == hi, this is a step: with `rising`, 0 below lo and 1 from lo on; otherwise 1 up to
/// lo and 0 above.
struct Placement {
  float origin, scale, offset;
  Placement(double lo, double hi, bool rising);
};

}  // namespace scolopax
