// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "renderer/core/error.h"
#include "renderer/data/field_view.h"
#include "renderer/kernel/lanes.h"
#include "renderer/kernel/optical_curve.h"

namespace scolopax {

namespace {

/// The least float at which `reaches` is true, near `guess`.
template <class Reaches>
float leastThat(float guess, const Reaches& reaches) {
  constexpr int kNear = 100;  // the guess is rounded, and so is what it is compared with
  for (int i = 0; i < kNear && reaches(std::nextafter(guess, -kernel::kInfinity)); ++i)
    guess = std::nextafter(guess, -kernel::kInfinity);
  for (int i = 0; i < kNear && !reaches(guess); ++i) guess = std::nextafter(guess, kernel::kInfinity);
  return guess;
}

/// Sets the stored values of the knots, so that kernels find the same opacity and colour before and behind a
/// knot whether they compare stored values or positions. `channel` has the placement and the gamma.
void setStoredValues(OpticalCurve& curve, const kernel::ChannelView& channel) {
  kernel::ChannelView linear = channel;
  linear.gamma = 1;
  for (kernel::OpticalKnot& knot : curve.knots) {
    const double position = std::pow(double(knot.position), 1.0 / double(channel.gamma));
    const double stored = (position - double(channel.offset)) / std::abs(double(channel.scale));
    // With a gamma, all values before the range have the position 0.
    const kernel::ChannelView& compared = knot.position > 0 ? channel : linear;
    knot.stored = leastThat(float(stored), [&](float at) {
      return kernel::positionAt<kernel::One>(compared, at) >= knot.position;
    });
  }
}

}  // namespace

TransferFunction::TransferFunction(const ChannelFacts& channel, const ChannelAppearance& a)
    : gamma_(float(a.gamma)),
      density_(float(std::min(a.density, 1e30))),
      weight_(float(a.weight)),
      material_{float(a.material.ambient), float(a.material.diffuse), float(a.material.specular),
                float(a.material.shininess)} {
  opacity_ = makeCurve(a.opacity, "opacity");
  if (a.peaks == Peaks::only) std::fill(opacity_.values.begin(), opacity_.values.end(), 0.0f);
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
  setStoredValues(optical_, placed());
  inverseRange_ = float(1.0 / std::abs(hi - lo));
}

kernel::ChannelView TransferFunction::placed() const {
  kernel::ChannelView view{};
  view.origin = placement_.origin;
  view.scale = placement_.scale;
  view.offset = placement_.offset;
  view.gamma = gamma_;
  view.density = density_;
  return view;
}

kernel::ChannelView TransferFunction::view(const Channel& channel) const {
  kernel::ChannelView view = placed();
  view.field = fieldView(channel);
  view.weight = weight_;
  view.material = material_;
  view.inverseRange = inverseRange_;
  view.opacity = opacity_.view();
  view.color = color_.view();
  view.optical = optical_.view();
  return view;
}

float TransferFunction::majorant(ValueInterval interval) const {
  if (!(interval.lo <= interval.hi)) return 0.0f;
  kernel::ChannelView channel = placed();
  channel.opacity = opacity_.view();
  return kernel::largestExtinction(channel, interval.lo, interval.hi);
}

bool TransferFunction::invisible() const {
  return density_ == 0.0f || *std::max_element(opacity_.values.begin(), opacity_.values.end()) == 0.0f;
}

}  // namespace scolopax
