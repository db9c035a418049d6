// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/piece_rules.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "renderer/reference/gauss_rule.h"

namespace scolopax::reference {
namespace {

/// The interpolatory rule on given nodes in [0,1]; members as in GaussRule.
template <int N>
struct NodeRule {
  std::array<double, N> node, weight;
  std::array<std::array<double, N>, N> toNode;
  explicit NodeRule(const std::array<double, N>& nodes) : node(nodes) {
    const GaussRule<8> gauss;
    for (std::size_t j = 0; j < N; ++j) {
      weight[j] = integral(gauss, j, 1);
      for (std::size_t i = 0; i < N; ++i) toNode[i][j] = integral(gauss, j, node[i]);
    }
  }

 private:
  /// Integral from 0 to `end` of the Lagrange polynomial of node j.
  double integral(const GaussRule<8>& gauss, std::size_t j, double end) const {
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      double value = gauss.weight[k];
      for (std::size_t i = 0; i < N; ++i)
        if (i != j) value *= (end * gauss.node[k] - node[i]) / (node[j] - node[i]);
      sum += value;
    }
    return end * sum;
  }
};

template <class Rule, std::size_t N>
PieceLight lightOf(const Rule& rule, const std::array<Medium, N>& medium, double length) {
  PieceLight light;
  for (std::size_t i = 0; i < N; ++i) {
    light.opticalDepth += length * rule.weight[i] * medium[i].extinction;
    light.meanColor += rule.weight[i] * medium[i].emission;
  }
  if (light.opticalDepth == 0) return light;
  light.meanColor *= length / light.opticalDepth;
  if (!(light.opticalDepth <= kMaxPieceDepth)) return light;
  for (std::size_t i = 0; i < N; ++i) {
    double depth = 0;
    for (std::size_t j = 0; j < N; ++j) depth += rule.toNode[i][j] * medium[j].extinction;
    light.color += length * rule.weight[i] * std::exp(-depth * length) * medium[i].emission;
  }
  return light;
}

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

void compare(PieceEstimate& estimate, const PieceLight& other) {
  estimate.error = std::max({estimate.error, largest(estimate.light.color - other.color),
                             std::abs(estimate.light.opticalDepth - other.opticalDepth)});
  estimate.meanError = std::max(estimate.meanError, largest(estimate.light.meanColor - other.meanColor));
}

template <int N>
PieceLight gauss(const MediumAt& mediumAt, double length) {
  static const GaussRule<N> rule;
  std::array<Medium, N> medium;
  for (std::size_t i = 0; i < N; ++i) medium[i] = mediumAt(rule.node[i]);
  return lightOf(rule, medium, length);
}

}  // namespace

PieceEstimate smoothPiece(const MediumAt& mediumAt, double length) {
  PieceEstimate estimate{gauss<8>(mediumAt, length)};
  if (estimate.light.opticalDepth != 0) compare(estimate, gauss<4>(mediumAt, length));
  return estimate;
}

PieceEstimate roughPiece(const MediumAt& mediumAt, double length) {
  static const double kLobatto = 0.5 - 0.5 / std::sqrt(5), kKronrod = 0.5 - 0.5 * std::sqrt(2.0 / 3);
  static const NodeRule<7> seven({0, kKronrod, kLobatto, 0.5, 1 - kLobatto, 1 - kKronrod, 1});
  static const NodeRule<4> four({0, kLobatto, 1 - kLobatto, 1});
  static const NodeRule<3> three({0, 0.5, 1});
  std::array<Medium, 7> m;
  for (std::size_t i = 0; i < 7; ++i) m[i] = mediumAt(seven.node[i]);
  PieceEstimate estimate{lightOf(seven, m, length)};
  compare(estimate, lightOf(four, std::array{m[0], m[2], m[4], m[6]}, length));
  compare(estimate, lightOf(three, std::array{m[0], m[3], m[6]}, length));
  // A jump at the worst place causes an error of 1.15 times the difference.
  estimate.error *= 1.15;
  return estimate;
}

}  // namespace scolopax::reference
