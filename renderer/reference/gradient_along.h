// SPDX-License-Identifier: Apache-2.0
// The gradient along a straight line inside one cell, as a polynomial, from which the integrator finds where
// a ray's light bends or jumps. ScalarField::gradient defines the gradient at a point.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "renderer/reference/bernstein_vector.h"
#include "renderer/reference/scalar_field.h"

namespace scolopax::reference {

/// The gradient is `scaled` / `scale`. For cubic interpolation, `scaled` is of degree 8 and `scale` is 1. For
/// the others, `scaled` is a cubic and `scale` is 1 inside the volume; in the outermost cells, where central
/// differences become one-sided, `scale` is a product of distances that change with u.
struct GradientAlong {
  BernsteinVector scaled;  ///< degree <= 5, or 8
  Bernstein scale;         ///< > 0; degree <= 3, or 0
};

/// The gradient from `begin` (u = 0) to `end` (u = 1), in voxel coordinates, both in one cell or in one outer
/// half voxel. `worldFromGradient` converts changes per voxel step to the space and units of the result. None
/// if a voxel is not finite, where the gradient counts as zero.
std::optional<GradientAlong> gradientAlong(const ScalarField& field, const glm::dvec3& begin,
                                           const glm::dvec3& end, const glm::dmat3& worldFromGradient);

}  // namespace scolopax::reference
