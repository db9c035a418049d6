// SPDX-License-Identifier: Apache-2.0
#include "protocol/fields.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene_checks.h"
#include "server/resolve/parts.h"

namespace scolopax::server {
static_assert(protocol::kMaxMacrocellVoxels == std::uint32_t(kMaxMacrocell));

namespace {

void checkMacrocell(int size, const VolumeFacts& volume, std::size_t maxIntervals) {
  const auto tooMany = [&](int one) {
    return intervalCount(volume.grid.dims, volume.channels.size(), one) > maxIntervals;
  };
  int least = size;
  while (least < Scene().macrocell && tooMany(least)) ++least;
  if (least == size) return;
  throw protocol::ProtocolError(
      422, "/integrator/macrocell",
      "expected at least " + std::to_string(least) + " for this data set, found " + std::to_string(size));
}

}  // namespace

void resolveIntegrator(const protocol::Scene& scene, Scene& render, const VolumeFacts& volume,
                       std::size_t maxIntervals) {
  const protocol::Integrator& wire = scene.integrator;
  render.blend = valueOf<BlendMode>(kBlendModes, scene.blend.mode);
  render.method = valueOf<Method>(kMethods, wire.method);
  render.macrocell = int(wire.macrocell);
  checkMacrocell(render.macrocell, volume, maxIntervals);
  render.step = wire.step;
  refuseAt("/integrator/step", [&] { checkStep(render.step); });
  render.sampling = valueOf<Sampling>(kSamplings, wire.sampling);
  render.seed = wire.seed;
}

}  // namespace scolopax::server
