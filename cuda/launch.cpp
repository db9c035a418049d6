// SPDX-License-Identifier: Apache-2.0
#include "cuda/launch.h"

namespace scolopax::cuda {

bool isPlain(const DeviceBand& band, const kernel::ChannelView* hostChannels) {
  if (band.first || band.scene.surfaces) return false;
  for (int n = 0; n < band.scene.channelCount; ++n) {
    const kernel::ChannelView& channel = hostChannels[n];
    if (channel.factor.curve.count != 0 || channel.field.filter != kernel::Filter::trilinear) return false;
  }
  return true;
}

LaunchFunction chooseLaunch(const Instance& instance, const DeviceBand& band,
                            const kernel::ChannelView* hostChannels) {
  const bool plain = isPlain(band, hostChannels);
  return visitIntegrator(instance, [&](auto type) {
    using Integrator = typename decltype(type)::type;
    return plain ? launchOf<Integrator, kernel::PlainSceneView>(instance)
                 : launchOf<Integrator, kernel::SceneView>(instance);
  });
}

}  // namespace scolopax::cuda
