// SPDX-License-Identifier: Apache-2.0
// The light that a short piece of a ray adds, by quadrature from what the matter is at a few points of it,
// and an estimate of the error.
#pragma once
#include <array>
#include <functional>
#include <glm/vec3.hpp>

namespace scolopax::reference {

/// What a point of the ray does to the light on its way.
struct Medium {
  double extinction = 0;   ///< per world unit
  glm::dvec3 emission{0};  ///< extinction times radiance
};

/// Light that a piece of the ray adds as seen from its beginning, and how thick it is.
struct PieceLight {
  glm::dvec3 color{0};
  double opticalDepth = 0;
  glm::dvec3 meanColor{0};  ///< without regard to what is in front of what
};

/// Pieces thicker than this are not integrated: color stays 0.
inline constexpr double kMaxPieceDepth = 4;

/// By the better rule, and by how much others differ from it: the largest of color and opticalDepth, and of
/// meanColor.
struct PieceEstimate {
  PieceLight light;
  double error = 0, meanError = 0;
};

using MediumAt = std::function<Medium(double w)>;

/// Of a piece of length `length`, w from 0 to 1, in which all is smooth: Gauss rules of 8 and of 4 points.
PieceEstimate smoothPiece(const MediumAt& mediumAt, double length);

/// Of one that may hold a jump or a kink. Two Gauss rules agree by chance, wrong by a fifth of the jump,
/// whenever it lies beyond their outer points or where their weights happen to balance. These rules look at
/// both ends and the middle: seven points of Lobatto and Kronrod (Gander and Gautschi 2000) against Lobatto's
/// four and Simpson's three. One jump, wherever it lies, makes an error of at most `error`, one kink of half
/// of it, the edge of a square root of 2.2 times of it.
PieceEstimate roughPiece(const MediumAt& mediumAt, double length);

}  // namespace scolopax::reference
