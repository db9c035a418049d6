// SPDX-License-Identifier: Apache-2.0
// Named colour maps as control points in linear RGB.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "renderer/data/method.h"
#include "renderer/data/scene.h"

namespace scolopax {

/// Names and what they are, in the order of menus.
std::span<const NamedValue> colormaps();

/// The knots of a named map; throws Error(notFound) naming the known ones.
std::vector<ColorKnot> colormapKnots(std::string_view name);

}  // namespace scolopax
