// SPDX-License-Identifier: Apache-2.0
// Which instance of the kernels a scene needs: the one place where launchers turn run-time values into types.
#pragma once
#include <type_traits>

#include "renderer/data/scene.h"
#include "renderer/kernel/views.h"

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

struct Instance {
  Method method;  ///< automatic renders as superposed
  BlendMode blend;
  bool lit;        ///< shading or shadows
  bool voxelwise;  ///< quadrature also cuts rays at the faces of voxel cells
};
inline Instance instanceOf(Method method, BlendMode blend, const kernel::SceneView& view) {
  // Without lights there is nothing to block.
  return {method, blend, view.shading || (view.shadows && view.lightCount > 0), view.cutsAtVoxels()};
}

/// Returns f(std::type_identity<Integrator>{}).
template <class F>
auto visitIntegrator(const Instance& instance, F&& f) {
  switch (instance.method) {
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
  return instance.voxelwise ? f(std::type_identity<kernel::RayMarch<kernel::VoxelCells>>{})
                            : f(std::type_identity<kernel::RayMarch<kernel::EqualSteps>>{});
}

/// Returns f(std::type_identity<Blend>{}, std::type_identity<Lighting>{}).
template <class F>
auto visitBlendAndLight(const Instance& instance, F&& f) {
  const auto with = [&](auto blend) {
    return instance.lit ? f(blend, std::type_identity<kernel::Lit>{})
                        : f(blend, std::type_identity<kernel::Unlit>{});
  };
  switch (instance.blend) {
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
