// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/defaults.h"

#include <algorithm>
#include <cmath>

namespace scolopax {
namespace {

/// Optical depth of a typical structure, all channels together: the outside is clearly visible, and the
/// inside still shows through.
constexpr double kStructureDepth = 6.0;

/// Share of the voxels below the default range, for a single channel and for each of several.
constexpr double kBelowOnly = 0.5, kBelowEach = 0.92;

}  // namespace

ValueRange defaultRange(const VolumeFacts& volume, int channel) {
  const ChannelFacts& c = volume.channels[std::size_t(channel)];
  if (c.look.window) return *c.look.window;
  const Histogram& h = c.histogram;
  double lo = h.quantile(volume.channels.size() == 1 ? kBelowOnly : kBelowEach), hi = h.quantile(0.9995);
  if (!(lo < hi)) lo = h.minimum, hi = h.maximum;  // nearly all voxels have one value
  if (lo < hi) return {lo, hi};
  // One value everywhere: visible unless it is zero.
  if (lo == 0) return {0, 1};
  return {std::min(lo, 0.0), std::max(lo, 0.0)};
}

std::array<std::uint8_t, 3> defaultColor(int index) {
  // Bright on black and far apart in hue; the first four also for the two common kinds of colour blindness.
  static constexpr std::array<std::uint8_t, 3> kColors[] = {
      {0xff, 0x5a, 0x3c}, {0x35, 0xc9, 0xff}, {0xff, 0xd1, 0x3b}, {0xc5, 0x7b, 0xff},
      {0x3d, 0xe0, 0x8a}, {0xff, 0x7a, 0xc6}, {0x4a, 0x7d, 0xff}, {0xff, 0x9d, 0x2e},
      {0xb4, 0xf0, 0x4a}, {0x2f, 0xe0, 0xd0}, {0xff, 0xb3, 0xa0}, {0xe8, 0xe8, 0xf0}};
  return kColors[std::size_t(index) % std::size(kColors)];
}

std::array<std::uint8_t, 3> defaultColor(const VolumeFacts& volume, int channel) {
  const auto& stated = volume.channels[std::size_t(channel)].look.color;
  return stated ? *stated : defaultColor(channel);
}

double defaultDensity(const VolumeFacts& volume, int channel) {
  const ChannelFacts& c = volume.channels[std::size_t(channel)];
  const ValueRange range = defaultRange(volume, channel);
  // Share of the voxels that the ramp makes visible, and their mean opacity.
  constexpr int kSteps = 1024;
  int seen = 0;
  double opacity = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double value = c.histogram.quantile((i + 0.5) / kSteps);
    const double p = std::clamp((value - range.lo) / (range.hi - range.lo), 0.0, 1.0);
    if (p < 0.1) continue;
    ++seen;
    opacity += p;
  }
  const double share = std::max(seen, 1) / double(kSteps);
  const double mean = seen > 0 ? opacity / seen : 0.5;
  // Edge of a cube that the visible voxels would fill: how thick the structures are, roughly.
  const double thickness = volume.grid.diagonal() / std::sqrt(3.0) * std::cbrt(share);
  return kStructureDepth / std::sqrt(double(volume.channels.size())) / (mean * thickness);
}

}  // namespace scolopax
