// SPDX-License-Identifier: Apache-2.0
// Instead of renderer/data/colormap.cpp, which takes its maps from OpenImageIO: nothing here shows them.
#include "renderer/core/error.h"
#include "renderer/data/colormap.h"

namespace scolopax {

std::span<const NamedValue> colormaps() { return {}; }

std::vector<ColorKnot> colormapKnots(std::string_view name) {
  throw Error(ErrorCode::notFound, "there is no colour map " + std::string(name));
}

}  // namespace scolopax
