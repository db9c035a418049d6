// SPDX-License-Identifier: Apache-2.0
// Which instance of the kernels a scene needs: the one place where launchers turn run-time values into types.
#pragma once
#include <type_traits>

#include "renderer/data/scene.h"

namespace scolopax::kernel {
// Declared only: a file that compiles an integrator includes it, and no other.
template <class Tracker>
struct Analog;
struct Superposed;
struct Cumulative;
struct SyncDda;
struct NDda;
template <class Steps>
struct RayMarch;
struct EqualSteps;
struct VoxelCells;
struct BlendDensity;
struct BlendMax;
struct BlendMix;
struct BlendComposite;
struct Unlit;
struct Lit;
}  // namespace scolopax::kernel

namespace scolopax {

/// Returns f(std::type_identity<Integrator>{}). A backend normally resolves Method::automatic first; here it
/// counts as superposed.
template <class F>
auto visitIntegrator(const Scene& scene, F&& f) {
  switch (scene.method) {
    case Method::automatic:
    case Method::superposed:
      return f(std::type_identity<kernel::Analog<kernel::Superposed>>{});
    case Method::cumulative:
      return f(std::type_identity<kernel::Analog<kernel::Cumulative>>{});
    case Method::syncDda:
      return f(std::type_identity<kernel::Analog<kernel::SyncDda>>{});
    case Method::nDda:
      return f(std::type_identity<kernel::Analog<kernel::NDda>>{});
    case Method::raymarch:
    case Method::hybrid:
      break;
  }
  return f(std::type_identity<kernel::RayMarch<kernel::EqualSteps>>{});
}

/// Returns f(std::type_identity<Lighting>{}).
template <class F>
auto visitLight(const Scene& scene, F&& f) {
  return scene.shading || scene.shadows ? f(std::type_identity<kernel::Lit>{})
                                        : f(std::type_identity<kernel::Unlit>{});
}

/// Returns f(std::type_identity<Blend>{}, std::type_identity<Lighting>{}).
template <class F>
auto visitBlendAndLight(const Scene& scene, F&& f) {
  const auto with = [&](auto blend) {
    return visitLight(scene, [&](auto lighting) { return f(blend, lighting); });
  };
  switch (scene.blend) {
    case BlendMode::density:
      return with(std::type_identity<kernel::BlendDensity>{});
    case BlendMode::max:
      return with(std::type_identity<kernel::BlendMax>{});
    case BlendMode::mix:
      return with(std::type_identity<kernel::BlendMix>{});
    case BlendMode::composite:
      break;
  }
  return with(std::type_identity<kernel::BlendComposite>{});
}

}  // namespace scolopax
