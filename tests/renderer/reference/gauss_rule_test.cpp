// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/gauss_rule.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scolopax::reference {
namespace {

template <int N>
void expectExact() {
  const GaussRule<N> rule;
  for (int degree = 0; degree < 2 * N; ++degree) {
    double sum = 0;
    for (std::size_t i = 0; i < N; ++i) sum += rule.weight[i] * std::pow(rule.node[i], degree);
    EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-15) << "degree " << degree;
  }
  for (std::size_t i = 0; i < N; ++i)
    for (int degree = 0; degree < N; ++degree) {
      double sum = 0;
      for (std::size_t j = 0; j < N; ++j) sum += rule.toNode[i][j] * std::pow(rule.node[j], degree);
      EXPECT_NEAR(sum, std::pow(rule.node[i], degree + 1) / (degree + 1), 1e-14) << "degree " << degree;
    }
}

TEST(GaussRule, IsExactForPolynomialsUpToItsDegree) {
  expectExact<2>();
  expectExact<4>();
  expectExact<8>();
}

TEST(GaussRule, HasAscendingNodesInsideTheInterval) {
  const GaussRule<8> rule;
  EXPECT_GT(rule.node[0], 0);
  for (std::size_t i = 1; i < 8; ++i) EXPECT_GT(rule.node[i], rule.node[i - 1]);
  EXPECT_LT(rule.node[7], 1);
}

}  // namespace
}  // namespace scolopax::reference
