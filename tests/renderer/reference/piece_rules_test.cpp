// SPDX-License-Identifier: Apache-2.0
// The error bounds that the quadrature rules claim, against closed forms.
#include "renderer/reference/piece_rules.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scolopax::reference {
namespace {

constexpr double kThin = 1e-9;  // extinction of matter that hides nothing behind it

/// Radiance of thin matter with emission f(w), 3 long.
template <class F>
PieceEstimate thin(const F& f) {
  return roughPiece([&](double w) { return Medium{kThin, glm::dvec3(f(w))}; }, 3);
}

/// The largest |error| - factor x claim over places x in (0,1) before which f(x, w) is 0; `integral` is the
/// integral of f over the piece.
template <class F, class Integral>
double largestExcess(double factor, const F& f, const Integral& integral) {
  double most = -1;
  for (int i = 1; i < 5000; ++i) {
    const double x = i / 5000.0 + 1e-7;
    const PieceEstimate found = thin([&](double w) { return w > x ? f(x, w) : 0.0; });
    most = std::max(most, std::abs(found.light.color.g - 3 * integral(x)) - factor * found.error);
  }
  return most;
}

TEST(RoughPiece, ClaimsTheErrorOfAJumpWhereverItLies) {
  EXPECT_LE(largestExcess(
                1, [](double, double) { return 1.0; }, [](double x) { return 1 - x; }),
            1e-9);
}

TEST(RoughPiece, ClaimsTwiceTheErrorOfAKinkWhereverItLies) {
  EXPECT_LE(
      largestExcess(
          0.5, [](double x, double w) { return w - x; }, [](double x) { return (1 - x) * (1 - x) / 2; }),
      1e-9);
}

TEST(RoughPiece, ClaimsAtLeastHalfTheErrorOfTheEdgeOfASquareRoot) {
  EXPECT_LE(largestExcess(
                2.25, [](double x, double w) { return std::sqrt(w - x); },
                [](double x) { return std::pow(1 - x, 1.5) / 1.5; }),
            1e-9);
}

TEST(RoughPiece, IsOfHighOrderWhereAllIsSmooth) {
  const PieceEstimate found = thin([](double w) { return std::exp(w); });
  EXPECT_NEAR(found.light.color.r, 3 * std::expm1(1), 1e-8);
  EXPECT_LT(found.error, 3e-3);
  EXPECT_NEAR(found.light.meanColor.r, std::expm1(1) / kThin, 1);
}

TEST(Pieces, HideWhatLiesBehindOtherMatter) {
  // Radiance 1, extinction 2w over length 1.5: colour is alpha.
  for (const auto& rule : {smoothPiece, roughPiece}) {
    const PieceEstimate found = rule([](double w) { return Medium{2 * w, glm::dvec3(2 * w)}; }, 1.5);
    EXPECT_NEAR(found.light.opticalDepth, 1.5, 1e-14);
    EXPECT_NEAR(found.light.color.b, -std::expm1(-1.5), 1e-5);
    EXPECT_GE(found.error, std::abs(found.light.color.b + std::expm1(-1.5)));
    EXPECT_NEAR(found.light.meanColor.b, 1, 1e-14);
  }
}

}  // namespace
}  // namespace scolopax::reference
