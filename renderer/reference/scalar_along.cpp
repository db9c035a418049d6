// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/scalar_along.h"

namespace scolopax::reference {
namespace {

constexpr double kLastBit = 0x1p-52;  // of a u that is near 1
constexpr double kOffPlane = 1e-9;    // voxels, by which rounding may carry a ray off the plane it runs along

}  // namespace

void ScalarAlong::appendCrossings(double value, std::vector<double>& crossings) const {
  if (const auto* cell = std::get_if<CellScalar>(&scalar_)) return cell->appendCrossings(value, crossings);
  if (lower() < value && value < upper())
    (std::get<Bernstein>(scalar_) - value).appendSignChanges(0, crossings, kLastBit);
}

std::optional<ScalarAlong> scalarAlong(const ScalarField& field, const CellOnRay& part) {
  switch (field.interpolation()) {
    case Interpolation::trilinear:
      break;
    case Interpolation::cubic: {
      const auto spline = field.spline(glm::ivec3(part.cell));
      if (!spline) return std::nullopt;
      return ScalarAlong(spline->along(part.begin, part.end));
    }
    case Interpolation::nearest: {
      const auto voxel = field.nearestVoxel(part.middle + kOffPlane);
      if (!voxel) return std::nullopt;
      return ScalarAlong(CellScalar(*voxel));
    }
  }
  const auto corners = field.corners(glm::ivec3(part.cell));
  if (!corners) return std::nullopt;
  return ScalarAlong(CellScalar(*corners, part.begin, part.end));
}

}  // namespace scolopax::reference
