// SPDX-License-Identifier: Apache-2.0
// Surfaces of a channel, in double: at its isovalues and at the peaks of its opacity curve.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/reference/channel_curves.h"

namespace scolopax::reference {

/// A surface between where a scalar is at least `value` and where it is below.
struct Surface {
  double value;      ///< data units
  double opacity;    ///< share of a ray's light that it takes
  glm::dvec3 color;  ///< linear RGB
};

/// Isovalues first, then peaks. Surfaces without opacity are left out. Throws Error(badInput) for a value
/// that is not finite or an opacity outside [0,1].
std::vector<Surface> surfacesOf(const ChannelAppearance& appearance, const ChannelCurves& curves,
                                double smallestSpacing);

}  // namespace scolopax::reference
