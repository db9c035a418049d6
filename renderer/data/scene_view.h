// SPDX-License-Identifier: Apache-2.0
// Converts a scene to the form that kernels read. A render plan adds the macrocells.
#pragma once
#include <optional>
#include <span>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Share of a ray's light for which a method with a step computes lighting once.
float stratumOf(Method method);

/// A view of a checked scene, without macrocells. `rays` are those of its camera. `clip`: as clipView() gives
/// it; if nothing remains of the volume, the view has no channels. Borrows `channels`, the visible ones.
kernel::SceneView sceneView(const Scene& scene, const Grid& grid, const kernel::CameraRays& rays,
                            const std::optional<kernel::ClipView>& clip,
                            std::span<const kernel::ChannelView> channels);

}  // namespace scolopax
