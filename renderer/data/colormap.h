// SPDX-License-Identifier: Apache-2.0
// Named colour maps as control points in linear RGB.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "renderer/data/method.h"
#include "renderer/data/scene.h"

namespace scolopax {

/// Names and descriptions, in menu order.
std::span<const NamedValue> colormaps();

/// The knots of a named map. Throws Error(notFound), listing the known names.
std::vector<ColorKnot> colormapKnots(std::string_view name);

}  // namespace scolopax
