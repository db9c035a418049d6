// SPDX-License-Identifier: Apache-2.0
// Checks of scenes. Cameras and curves are checked where they are converted for the kernels.
#pragma once
#include <cstddef>

#include "renderer/data/scene.h"

namespace scolopax {

inline constexpr int kMaxMacrocell = 64;  ///< voxels per macrocell edge

/// Throws Error(badInput) if a side is not in 1..kMaxImageSide.
void checkImageSize(const Scene& scene);
/// Throws Error(badInput) for a light whose direction is zero, whose position or direction has no finite
/// length, or whose colour or intensity is negative or not finite.
void checkLight(const Light& light);
/// Throws Error(badInput) for a step that Scene::step does not allow.
void checkStep(double step);
/// Throws Error(badInput) if RenderPlan would refuse the scene, for a volume of so many channels, for
/// anything but its camera and curves.
void checkScene(const Scene& scene, std::size_t channels);

}  // namespace scolopax
