// SPDX-License-Identifier: Apache-2.0
// The light that a short piece of a ray adds, by quadrature from the medium at a few points of it, and an
// estimate of the error.
#pragma once
#include <array>
#include <functional>
#include <glm/vec3.hpp>

namespace scolopax::reference {

/// The medium at a point of the ray.
struct Medium {
  double extinction = 0;   ///< per world unit
  glm::dvec3 emission{0};  ///< extinction times radiance
};

/// Light that a piece of the ray adds, as seen from its beginning, and its optical depth.
struct PieceLight {
  glm::dvec3 color{0};
  double opticalDepth = 0;
  glm::dvec3 meanColor{0};  ///< mean radiance, weighted by extinction, without attenuation
};

/// Pieces thicker than this are not integrated: color stays 0.
inline constexpr double kMaxPieceDepth = 4;

/// The result of the best rule, and the largest difference of other rules from it: `error` in color and
/// opticalDepth, `meanError` in meanColor.
struct PieceEstimate {
  PieceLight light;
  double error = 0, meanError = 0;
};

using MediumAt = std::function<Medium(double w)>;

/// For a piece of length `length`, w from 0 to 1, in which everything is smooth: Gauss rules of 8 and of 4
/// points.
PieceEstimate smoothPiece(const MediumAt& mediumAt, double length);

/// For a piece that may hold a jump or a kink. Two Gauss rules agree by chance, wrong by a fifth of the jump,
/// if it lies beyond their outer points or where their weights happen to balance. The rules used here
/// evaluate both ends and the middle: the seven points of Lobatto and Kronrod (Gander and Gautschi 2000)
/// against Lobatto's four and Simpson's three. One jump, wherever it lies, causes an error of at most
/// `error`; one kink, of half of it; the edge of a square root, of 2.2 times it.
PieceEstimate roughPiece(const MediumAt& mediumAt, double length);

}  // namespace scolopax::reference
