// SPDX-License-Identifier: Apache-2.0
#include "protocol/fields.h"
#include "renderer/data/colormap.h"
#include "renderer/data/defaults.h"
#include "renderer/data/image.h"
#include "renderer/data/surfaces.h"
#include "server/hex_color.h"
#include "server/resolve/parts.h"

namespace scolopax::server {
static_assert(protocol::kMaxChannelItems == std::size_t(kMaxChannels));
static_assert(protocol::kMaxIsovalueItems == std::size_t(kernel::kMaxSurfaces));

namespace {

std::vector<ColorKnot> knotsOf(const protocol::Colormap& colormap) {
  if (const auto* name = std::get_if<std::string>(&colormap)) return colormapKnots(*name);
  std::vector<ColorKnot> knots;
  for (const auto& point : std::get<std::vector<protocol::ColorPoint>>(colormap))
    knots.push_back({point.position, linearOf(point.color)});
  return knots;
}

}  // namespace

void resolveChannels(protocol::Scene& scene, Scene& render, const VolumeFacts& volume) {
  const auto& channels = volume.channels;
  scene.channels.resize(channels.size());
  for (std::size_t i = 0; i < channels.size(); ++i) {
    protocol::Channel& wire = scene.channels[i];
    ChannelAppearance& look = render.channels.emplace_back();
    if (!wire.name) wire.name = channels[i].name;
    if (!wire.range) {
      const ValueRange range = defaultRange(volume, int(i));
      wire.range = {range.lo, range.hi};
    }
    if (!wire.color && !wire.colormap) {
      if (channels.size() == 1 && !channels[i].look.color)
        wire.colormap = std::string(kDefaultColormap);
      else
        wire.color = hexOf(defaultColor(volume, int(i)));
    }
    if (!wire.density) wire.density = defaultDensity(volume, int(i));
    look.visible = wire.visible;
    look.rangeLo = (*wire.range)[0];
    look.rangeHi = (*wire.range)[1];
    look.interpolation = valueOf<Interpolation>(kInterpolations, wire.interpolation);
    look.gamma = wire.gamma;
    look.opacity.clear();
    for (const auto& point : wire.opacity) look.opacity.push_back({point.position, point.value});
    look.color = wire.color ? std::vector<ColorKnot>{{0, linearOf(*wire.color)}} : knotsOf(*wire.colormap);
    look.density = *wire.density;
    for (protocol::Isovalue& isovalue : wire.isovalues) {
      if (!isovalue.value) isovalue.value = 0.5 * (*wire.range)[0] + 0.5 * (*wire.range)[1];
      Isovalue& surface = look.isovalues.emplace_back(Isovalue{*isovalue.value, isovalue.opacity, {}});
      if (isovalue.color) surface.color = linearOf(*isovalue.color);
    }
    look.peaks = valueOf<Peaks>(kPeaks, wire.peaks);
    refuseAt("/channels/" + std::to_string(i),
             [&] { Surfaces(channels[i], look, 0, volume.grid.smallestSpacing()); });
    look.weight = wire.weight;
    look.material = {wire.material.ambient, wire.material.diffuse, wire.material.specular,
                     wire.material.shininess};
  }
}

}  // namespace scolopax::server
