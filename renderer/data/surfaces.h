// SPDX-License-Identifier: Apache-2.0
// The surfaces of a channel in the form that kernels read: at its isovalues and at the peaks of its opacity
// curve.
#pragma once
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "renderer/kernel/views.h"
#include "renderer/kernel/views/surface_view.h"

namespace scolopax {

class Surfaces {
 public:
  Surfaces() = default;
  /// `origin` is that of the channel's view. Throws Error(badInput), naming the fault: a value that is not
  /// finite, an opacity outside [0,1], more surfaces than kernel::kMaxSurfaces.
  Surfaces(const ChannelFacts& channel, const ChannelAppearance& appearance, float origin,
           double smallestSpacing);
  bool any() const { return !views_.empty(); }
  /// Adds them to a view of the channel. Valid while this object lives.
  void addTo(kernel::ChannelView& view) const;
  /// Whether samples in the interval of stored values may have the value of a surface: 1, else 0. `range`:
  /// between all samples of the channel.
  float presence(ValueInterval interval, float range) const;

 private:
  std::vector<kernel::SurfaceView> views_;
  std::vector<float> stored_;  ///< their stored values
};

/// A maximum of a curve.
struct Peak {
  double position, value;
};
/// Maxima of a curve inside (0,1), ascending; of a plateau, its middle. Limits at jumps count as values.
std::vector<Peak> peaksOf(const std::vector<OpacityKnot>& curve);

}  // namespace scolopax
