// SPDX-License-Identifier: Apache-2.0
// Gauss-Legendre quadrature for the reference integrator.
#pragma once
#include <array>

namespace scolopax::reference {

/// N nodes on [0,1]. The integral over [0,1] is sum_i weight[i] f(node[i]), exact for polynomials of degree
/// 2N-1; the integral from 0 to node[i] is sum_j toNode[i][j] f(node[j]), exact for degree N-1.
template <int N>
struct GaussRule {
  std::array<double, N> node, weight;
  std::array<std::array<double, N>, N> toNode;
  GaussRule();
};

extern template struct GaussRule<2>;
extern template struct GaussRule<4>;
extern template struct GaussRule<8>;

}  // namespace scolopax::reference
