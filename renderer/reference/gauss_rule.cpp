// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/gauss_rule.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace scolopax::reference {
namespace {

/// P_0(x) ... P_N(x), Legendre polynomials on [-1,1].
template <int N>
std::array<double, N + 1> legendre(double x) {
  std::array<double, N + 1> p;
  p[0] = 1;
  p[1] = x;
  for (std::size_t k = 1; k < N; ++k)
    p[k + 1] = (double(2 * k + 1) * x * p[k] - double(k) * p[k - 1]) / double(k + 1);
  return p;
}

}  // namespace

template <int N>
GaussRule<N>::GaussRule() {
  std::array<std::array<double, N + 1>, N> p;  // polynomials at the nodes
  std::array<double, N> x;                     // nodes on [-1,1], ascending: roots of P_N by Newton's method
  for (std::size_t i = 0; i < N; ++i) {
    x[i] = -std::cos(std::numbers::pi * (double(i) + 0.75) / (N + 0.5));
    double derivative = 0;
    for (int step = 0; step < 10; ++step) {
      p[i] = legendre<N>(x[i]);
      derivative = N * (x[i] * p[i][N] - p[i][N - 1]) / (x[i] * x[i] - 1);
      x[i] -= p[i][N] / derivative;
    }
    p[i] = legendre<N>(x[i]);
    node[i] = 0.5 * (x[i] + 1);
    weight[i] = 1 / ((1 - x[i] * x[i]) * derivative * derivative);
  }
  // The Lagrange polynomials in the Legendre basis are l_j = weight_j sum_k (2k+1) P_k(x_j) P_k. The integral
  // of P_k from -1 to x is (P_{k+1}(x) - P_{k-1}(x)) / (2k+1); for k = 0 it is x + 1.
  for (std::size_t i = 0; i < N; ++i)
    for (std::size_t j = 0; j < N; ++j) {
      double sum = x[i] + 1;
      for (std::size_t k = 1; k < N; ++k) sum += p[j][k] * (p[i][k + 1] - p[i][k - 1]);
      toNode[i][j] = 0.5 * weight[j] * sum;
    }
}

template struct GaussRule<2>;
template struct GaussRule<4>;
template struct GaussRule<8>;

}  // namespace scolopax::reference
