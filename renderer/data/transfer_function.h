// SPDX-License-Identifier: Apache-2.0
// A channel's curves in the form the kernels evaluate, made from its appearance at every edit of it.
#pragma once
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "renderer/kernel/views.h"

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

/// Owner of both curves on the knots of both.
struct OpticalCurve {
  std::vector<kernel::OpticalKnot> knots;
  std::vector<std::uint16_t> buckets;
  float first = 0, last = 1;  ///< no opacity at positions up to `first` and from `last` on
  kernel::OpticalCurveView view() const {
    return {knots.data(), buckets.data(), int(knots.size()), first, last};
  }
};

class TransferFunction {
 public:
  /// Throws Error(badInput) naming what is wrong: no knots, positions that decrease, values out of range.
  TransferFunction(const Channel& channel, const ChannelAppearance& appearance);
  /// Voxels are the channel's. Valid as long as this object.
  kernel::ChannelView view(const Channel& channel) const;
  /// Least upper bound, in float, of the kernels' extinction over an interval of stored values.
  float majorant(ValueInterval interval) const;
  /// True when no value has any extinction: the channel need not be in the plan.
  bool invisible() const;

 private:
  Curve<float> opacity_;
  Curve<glm::vec3> color_;
  OpticalCurve optical_;
  float origin_, scale_, offset_;
  float gamma_, density_, weight_, inverseRange_;
  kernel::MaterialView material_;
};

}  // namespace scolopax
