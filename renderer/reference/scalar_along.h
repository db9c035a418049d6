// SPDX-License-Identifier: Apache-2.0
// A channel's scalar along the part of a ray between two neighbouring cuts, whatever its interpolation.
#pragma once
#include <optional>
#include <variant>
#include <vector>

#include "renderer/reference/bernstein.h"
#include "renderer/reference/cell_scalar.h"
#include "renderer/reference/ray_cells.h"
#include "renderer/reference/scalar_field.h"

namespace scolopax::reference {

/// A polynomial of u in [0,1]. Trilinear: of degree 3. Cubic: of degree 9. Nearest: constant, to the last
/// bit.
class ScalarAlong {
 public:
  explicit ScalarAlong(const CellScalar& scalar) : scalar_(scalar) {}
  explicit ScalarAlong(const Bernstein& spline) : scalar_(spline) {}

  double operator()(double u) const {
    return std::visit([u](const auto& scalar) { return scalar(u); }, scalar_);
  }
  /// Bounds over [0,1].
  double lower() const {
    return std::visit([](const auto& scalar) { return scalar.lower(); }, scalar_);
  }
  double upper() const {
    return std::visit([](const auto& scalar) { return scalar.upper(); }, scalar_);
  }
  /// Appends every u in (0,1) at which the scalar crosses `value`.
  void appendCrossings(double value, std::vector<double>& crossings) const;

 private:
  std::variant<CellScalar, Bernstein> scalar_;
};

/// The scalar of a field along a part of a ray; none where it has no value. For nearest, the ray must be cut
/// at the planes between voxels.
std::optional<ScalarAlong> scalarAlong(const ScalarField& field, const CellOnRay& part);

}  // namespace scolopax::reference
