// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/bernstein.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace scolopax::reference {
namespace {

Bernstein linear(double a, double b) { return Bernstein(std::array{a, b}); }

Bernstein withRoots(const std::vector<double>& roots) {
  Bernstein p(std::array{1.0});
  for (const double root : roots) p = p * linear(-root, 1 - root);
  return p;
}

std::vector<double> signChanges(const Bernstein& p, double noise = 1e-15) {
  std::vector<double> roots;
  p.appendSignChanges(noise, roots);
  return roots;
}

TEST(Bernstein, SumsProductsAndPartsTakeTheValuesThatTheyShould) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 100; ++trial) {
    std::array<double, 6> a;
    std::array<double, 4> b;
    for (double& x : a) x = unit(random);
    for (double& x : b) x = unit(random);
    const Bernstein p(a), q(b), product = p * q, sum = p + q, difference = q - p * 3;
    const double begin = 0.5 + 0.5 * unit(random), end = begin + (1 - begin) * std::abs(unit(random));
    const Bernstein part = p.between(begin, end);
    EXPECT_EQ(product.degree(), 8u);
    EXPECT_EQ(sum.degree(), 5u);
    for (const double u : {0.0, 0.1, 0.37, 0.5, 0.9, 1.0}) {
      EXPECT_NEAR(product(u), p(u) * q(u), 1e-13);
      EXPECT_NEAR(sum(u), p(u) + q(u), 1e-14);
      EXPECT_NEAR(difference(u), q(u) - 3 * p(u), 1e-13);
      EXPECT_NEAR(part(u), p(begin + u * (end - begin)), 1e-13);
      EXPECT_LE(part.lower(), part(u) + 1e-15);
      EXPECT_GE(part.upper(), part(u) - 1e-15);
    }
  }
}

TEST(Bernstein, ProductsOfTheHighestDegreeAreExact) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    std::array<double, Bernstein::kMaxDegree / 2 + 1> a;
    for (double& x : a) x = unit(random);
    const Bernstein p(a), square = p * p;
    EXPECT_EQ(square.degree(), Bernstein::kMaxDegree);
    for (const double u : {0.0, 0.1, 0.37, 0.5, 0.9, 1.0}) {
      EXPECT_NEAR(square(u), p(u) * p(u), 1e-14);
      EXPECT_NEAR((square - 0.25)(u), p(u) * p(u) - 0.25, 1e-14);
    }
  }
}

TEST(Bernstein, DerivativeIsTheSlope) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    std::array<double, 6> a;
    for (double& x : a) x = unit(random);
    const Bernstein p(a), slope = p.derivative();
    EXPECT_EQ(slope.degree(), 4u);
    for (const double u : {0.1, 0.37, 0.5, 0.9})
      EXPECT_NEAR(slope(u), (p(u + 1e-5) - p(u - 1e-5)) / 2e-5, 1e-7);  // third derivatives are below 1000
  }
  EXPECT_EQ(Bernstein(std::array{3.0}).derivative()(0.5), 0);
}

TEST(Bernstein, FindsRootsOnlyAsCloselyAsItIsAsked) {
  for (const double narrowest : {0x1p-10, 0x1p-24, 0x1p-44}) {
    std::vector<double> found;
    withRoots({0.3, 0.7}).appendSignChanges(1e-15, found, narrowest);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0], 0.3, narrowest + 1e-14);
    EXPECT_NEAR(found[1], 0.7, narrowest + 1e-14);
  }
}

TEST(Bernstein, FindsEverySimpleRootInsideAndNoOther) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-0.5, 1.5);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<double> roots, inside;
    for (int i = 0; i < 1 + trial % 6; ++i) roots.push_back(place(random));
    std::sort(roots.begin(), roots.end());
    for (const double root : roots)
      if (root > 0 && root < 1) inside.push_back(root);
    const std::vector<double> found = signChanges(withRoots(roots));
    ASSERT_EQ(found.size(), inside.size()) << "trial " << trial;
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_NEAR(found[i], inside[i], 1e-9) << "trial " << trial;
  }
}

TEST(Bernstein, FindsARootWhereItHalvesTheInterval) {
  EXPECT_EQ(signChanges(withRoots({0.5})), std::vector<double>{0.5});
  EXPECT_EQ(signChanges(withRoots({0.25})), std::vector<double>{0.25});
}

TEST(Bernstein, TellsTwoRootsApartThatLieClose) {
  const std::vector<double> found = signChanges(withRoots({0.3, 0.3 + 1e-5}));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0], 0.3, 1e-9);
  EXPECT_NEAR(found[1], 0.3 + 1e-5, 1e-9);
}

TEST(Bernstein, HasNoSignChangeWhereItTouchesZeroOrIsZeroButForNoise) {
  EXPECT_TRUE(signChanges(withRoots({0.3, 0.3}) + Bernstein(std::array{1e-9})).empty());
  EXPECT_TRUE(signChanges(Bernstein(std::array{0.0, 0.0, 0.0})).empty());
  EXPECT_TRUE(signChanges(Bernstein(std::array{1e-14, -1e-14, 1e-14}), 1e-13).empty());
}

}  // namespace
}  // namespace scolopax::reference
