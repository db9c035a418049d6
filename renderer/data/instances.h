// SPDX-License-Identifier: Apache-2.0
// Which instance of the kernels a scene asks for: the one place where launchers turn values into types.
#pragma once
#include "renderer/data/scene.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/raymarch.h"
#include "renderer/kernel/trackers/one_process.h"
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax {

/// Returns f(Integrator{}).
template <class F>
auto visitIntegrator(const Scene& scene, F&& f) {
  switch (scene.method) {
    case Method::superposed:
      return f(kernel::Analog<kernel::Superposed>{});
    case Method::cumulative:
      return f(kernel::Analog<kernel::Cumulative>{});
    case Method::syncDda:
      return f(kernel::Analog<kernel::SyncDda>{});
    case Method::nDda:
      return f(kernel::Analog<kernel::NDda>{});
    case Method::raymarch:
      break;
  }
  return f(kernel::RayMarch{});
}

/// Returns f(LightFeatures<...>{}).
template <class F>
auto visitLight(const Scene& scene, F&& f) {
  using kernel::LightFeatures;
  if (scene.shading) return scene.shadows ? f(LightFeatures<true, true>{}) : f(LightFeatures<true, false>{});
  return scene.shadows ? f(LightFeatures<false, true>{}) : f(LightFeatures<false, false>{});
}

/// Returns f(Blend{}, LightFeatures<...>{}).
template <class F>
auto visitBlendAndLight(const Scene& scene, F&& f) {
  const auto with = [&](auto blend) {
    return visitLight(scene, [&](auto features) { return f(blend, features); });
  };
  switch (scene.blend) {
    case BlendMode::density:
      return with(kernel::BlendDensity{});
    case BlendMode::max:
      return with(kernel::BlendMax{});
    case BlendMode::mix:
      return with(kernel::BlendMix{});
    case BlendMode::composite:
      break;
  }
  return with(kernel::BlendComposite{});
}

}  // namespace scolopax
