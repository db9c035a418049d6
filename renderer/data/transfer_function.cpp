// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "renderer/core/error.h"
#include "renderer/kernel/classify.h"

namespace scolopax {

TransferFunction::TransferFunction(const Channel& channel, const ChannelAppearance& a)
    : gamma_(float(a.gamma)),
      density_(float(std::min(a.density, 1e30))),
      weight_(float(a.weight)),
      material_{float(a.material.ambient), float(a.material.diffuse), float(a.material.specular),
                float(a.material.shininess)} {
  opacity_ = makeCurve(a.opacity, "opacity");
  color_ = makeCurve(a.color, "colormap");
  optical_ = makeOpticalCurve(opacity_, color_);
  if (!(a.gamma > 0) || !(a.density >= 0) || !std::isfinite(a.rangeLo) || !std::isfinite(a.rangeHi))
    throw Error(ErrorCode::badInput,
                "channel '" + channel.name + "': gamma must be above 0, density not negative, range finite");
  const Material& m = a.material;
  if (!(a.weight >= 0) || !(m.ambient >= 0) || !(m.diffuse >= 0) || !(m.specular >= 0) || !(m.shininess > 0))
    throw Error(ErrorCode::badInput, "channel '" + channel.name +
                                         "': weight and material must not be negative, shininess above 0");
  // The range in stored values. Ends that differ may become equal there by rounding.
  const double lo = (a.rangeLo - channel.intercept) / channel.slope;
  const double hi = (a.rangeHi - channel.intercept) / channel.slope;
  placement_ = Placement(lo, hi, (channel.slope > 0) == (a.rangeLo <= a.rangeHi));
  inverseRange_ = float(1.0 / std::abs(hi - lo));
}

kernel::ChannelView TransferFunction::view(const Channel& channel) const {
  kernel::ChannelView view{};
  view.voxels = channel.voxels.base();
  view.lane = int(channel.voxels.lane());
  view.stride = int(channel.voxels.stride());
  view.type = channel.voxels.type();
  view.origin = placement_.origin;
  view.scale = placement_.scale;
  view.offset = placement_.offset;
  view.gamma = gamma_;
  view.density = density_;
  view.weight = weight_;
  view.material = material_;
  view.inverseRange = inverseRange_;
  view.finite = channel.histogram.nonFiniteCount == 0;
  view.opacity = opacity_.view();
  view.color = color_.view();
  view.optical = optical_.view();
  return view;
}

float TransferFunction::majorant(ValueInterval interval) const {
  if (!(interval.lo <= interval.hi)) return 0.0f;
  kernel::ChannelView channel{};
  channel.origin = placement_.origin;
  channel.scale = placement_.scale;
  channel.offset = placement_.offset;
  channel.gamma = gamma_;
  channel.density = density_;
  channel.opacity = opacity_.view();
  return kernel::largestExtinction(channel, interval.lo, interval.hi);
}

bool TransferFunction::invisible() const {
  return density_ == 0.0f || *std::max_element(opacity_.values.begin(), opacity_.values.end()) == 0.0f;
}

}  // namespace scolopax
