// SPDX-License-Identifier: Apache-2.0
// A channel's curves in the form that the kernels evaluate, rebuilt from its appearance at every edit.
#pragma once
#include "renderer/data/curve.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "renderer/kernel/views.h"

namespace scolopax {

class TransferFunction {
 public:
  /// Throws Error(badInput), naming the fault: no knots, positions that decrease, values out of range.
  TransferFunction(const ChannelFacts& channel, const ChannelAppearance& appearance);
  /// With the voxels of `channel`, interpolated trilinearly. Valid while this object and the voxels live.
  kernel::ChannelView view(const Channel& channel) const;
  /// Least upper bound, in float, of the kernels' extinction over an interval of stored values.
  float majorant(ValueInterval interval) const;
  /// True when no value has any extinction.
  bool invisible() const;
  /// Of the view.
  float origin() const { return placement_.origin; }

 private:
  /// A view of placement, gamma and density alone.
  kernel::ChannelView placed() const;

  Curve<float> opacity_;
  Curve<glm::vec3> color_;
  OpticalCurve optical_;
  Placement placement_{0, 1, true};
  float gamma_, density_, weight_, inverseRange_;
  kernel::MaterialView material_;
};

}  // namespace scolopax
