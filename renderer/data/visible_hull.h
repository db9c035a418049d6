// SPDX-License-Identifier: Apache-2.0
// A rough and fast estimate of where a volume is visible under a scene's curves, by which the first view is
// framed. Made from coarse macrocells, which are measured when the volume is loaded.
#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"

namespace scolopax {

/// Macrocells, at most 64 along an axis: few enough to visit all of them within milliseconds.
MacrocellGrid buildCoarseMacrocells(const Volume& volume);

/// Points, in voxel coordinates, whose convex hull contains every sample that has extinction before clipping,
/// and every surface. The hull reaches beyond these samples by less than a macrocell, a step of its levels
/// and, with cubic interpolation, a voxel. Empty if nothing is visible. `cells`: macrocells of `volume`;
/// `channels`: one per channel of the volume. Throws Error(badInput) for a curve that cannot be rendered.
std::vector<glm::vec3> visibleHull(const VolumeFacts& volume, const MacrocellGrid& cells,
                                   std::span<const ChannelAppearance> channels);

}  // namespace scolopax
