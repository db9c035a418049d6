// SPDX-License-Identifier: Apache-2.0
// Where something of a volume can be seen under a scene's curves, roughly and at once: what the first view
// frames. Made from coarse macrocells, which are measured when the volume is loaded.
#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"

namespace scolopax {

/// Macrocells of which no more than 64 lie along an axis: so few that all are looked at within milliseconds.
MacrocellGrid buildCoarseMacrocells(const Volume& volume);

/// Points, in voxel coordinates, whose convex hull holds every sample that has any extinction; it reaches
/// beyond them by less than a macrocell and a step of its levels. Empty where nothing can be seen.
/// `channels`: one per channel of the volume, whose macrocells `cells` are. Throws Error(badInput) for a
/// curve that cannot be rendered.
std::vector<glm::vec3> visibleHull(const Volume& volume, const MacrocellGrid& cells,
                                   std::span<const ChannelAppearance> channels);

}  // namespace scolopax
