// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/bernstein.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scolopax::reference {
namespace {

using Row = std::array<double, Bernstein::kMaxDegree + 1>;

/// Row n of Pascal's triangle.
const Row& binomials(std::size_t n) {
  static const auto rows = [] {
    std::array<Row, Bernstein::kMaxDegree + 1> all{};
    for (std::size_t row = 0; row < all.size(); ++row) {
      all[row][0] = 1;
      for (std::size_t k = 1; k <= row; ++k) all[row][k] = all[row - 1][k - 1] + all[row - 1][k];
    }
    return all;
  }();
  return rows[n];
}

/// Exact where a and b are equal.
double lerp(double a, double b, double u) { return a + u * (b - a); }

}  // namespace

double binomial(std::size_t n, std::size_t k) { return binomials(n)[k]; }

Bernstein::Bernstein(std::span<const double> coefficients) : degree_(coefficients.size() - 1) {
  assert(coefficients.size() >= 1 && coefficients.size() <= b_.size());
  std::copy(coefficients.begin(), coefficients.end(), b_.begin());
}

double Bernstein::operator()(double u) const {
  Row b;
  std::copy_n(b_.begin(), degree_ + 1, b.begin());
  for (std::size_t level = degree_; level > 0; --level)
    for (std::size_t i = 0; i < level; ++i) b[i] = lerp(b[i], b[i + 1], u);
  return b[0];
}

/// De Casteljau's algorithm: the first value of each level is a coefficient of the left part, the last value
/// one of the right part, and stays in its place.
void Bernstein::splitAt(double u, Bernstein& left, Bernstein& right) const {
  left.degree_ = right.degree_ = degree_;
  Row& b = right.b_;
  std::copy_n(b_.begin(), degree_ + 1, b.begin());
  for (std::size_t level = degree_;; --level) {
    left.b_[degree_ - level] = b[0];
    if (level == 0) return;
    for (std::size_t i = 0; i < level; ++i) b[i] = lerp(b[i], b[i + 1], u);
  }
}

Bernstein Bernstein::between(double begin, double end) const {
  Bernstein rest, result, unused;
  splitAt(begin, unused, rest);
  rest.splitAt(begin < 1 ? (end - begin) / (1 - begin) : 1, result, unused);
  return result;
}

Bernstein Bernstein::derivative() const {
  Bernstein result;
  if (degree_ == 0) return result;
  result.degree_ = degree_ - 1;
  for (std::size_t k = 0; k < degree_; ++k) result.b_[k] = double(degree_) * (b_[k + 1] - b_[k]);
  return result;
}

void Bernstein::appendSignChanges(double noise, std::vector<double>& roots, double narrowest) const {
  appendSignChanges(noise, narrowest, 0, 1, roots);
}

/// For a polynomial that is the part [begin, end] of another. Its coefficients change sign at least as often
/// as its values: if they do not, there is no root.
void Bernstein::appendSignChanges(double noise, double narrowest, double begin, double end,
                                  std::vector<double>& roots) const {
  bool positive = false, negative = false;
  for (const double b : coefficients()) {
    positive = positive || b > noise;
    negative = negative || b < -noise;
  }
  if (!(positive && negative)) return;
  const double middle = 0.5 * (begin + end);
  if (end - begin < narrowest) {
    roots.push_back(middle);
    return;
  }
  Bernstein left, right;
  splitAt(0.5, left, right);
  left.appendSignChanges(noise, narrowest, begin, middle, roots);
  if (std::abs(right.b_[0]) <= noise) roots.push_back(middle);  // neither half sees this change
  right.appendSignChanges(noise, narrowest, middle, end, roots);
}

Bernstein Bernstein::operator*(const Bernstein& other) const {
  assert(degree_ + other.degree_ <= kMaxDegree);
  Bernstein product;
  product.degree_ = degree_ + other.degree_;
  for (std::size_t i = 0; i <= degree_; ++i)
    for (std::size_t j = 0; j <= other.degree_; ++j)
      product.b_[i + j] += binomials(degree_)[i] * b_[i] * binomials(other.degree_)[j] * other.b_[j];
  for (std::size_t k = 0; k <= product.degree_; ++k) product.b_[k] /= binomials(product.degree_)[k];
  return product;
}

Bernstein Bernstein::operator*(double factor) const {
  Bernstein product = *this;
  for (std::size_t k = 0; k <= degree_; ++k) product.b_[k] *= factor;
  return product;
}

Bernstein Bernstein::operator-(double value) const {
  Bernstein difference = *this;
  for (std::size_t k = 0; k <= degree_; ++k) difference.b_[k] -= value;
  return difference;
}

Bernstein Bernstein::elevated(std::size_t degree) const {
  if (degree == degree_) return *this;
  std::array<double, kMaxDegree + 1> ones;
  ones.fill(1);
  return *this * Bernstein(std::span(ones).first(degree - degree_ + 1));
}

Bernstein Bernstein::operator+(const Bernstein& other) const {
  const std::size_t degree = std::max(degree_, other.degree_);
  Bernstein sum = elevated(degree);
  const Bernstein b = other.elevated(degree);
  for (std::size_t k = 0; k <= degree; ++k) sum.b_[k] += b.b_[k];
  return sum;
}

}  // namespace scolopax::reference
