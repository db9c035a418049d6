// SPDX-License-Identifier: Apache-2.0
// Polynomials on [0,1] by their Bernstein coefficients, the smallest and largest of which bound all values;
// and where they change sign.
#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace scolopax::reference {

/// Rounding of sums and products of polynomials, relative to the longest vectors in them.
inline constexpr double kPolynomialNoise = 1e-13;

/// n over k; n up to Bernstein::kMaxDegree.
double binomial(std::size_t n, std::size_t k);

class Bernstein {
 public:
  /// Of the products in which LightCuts looks for kinks: (n.l)^2, where n is of degree 8 and l of degree 1.
  static constexpr std::size_t kMaxDegree = 18;
  static constexpr double kNarrowest = 0x1p-44;  ///< width of a root's bracket
  /// Takes degree + 1 coefficients: one is a constant, two are the values at 0 and 1.
  explicit Bernstein(std::span<const double> coefficients);
  Bernstein() : Bernstein(std::array{0.0}) {}

  std::size_t degree() const { return degree_; }
  std::span<const double> coefficients() const { return {b_.data(), degree_ + 1}; }
  double operator()(double u) const;
  /// Bounds over [0,1].
  double lower() const { return *std::min_element(b_.begin(), b_.begin() + degree_ + 1); }
  double upper() const { return *std::max_element(b_.begin(), b_.begin() + degree_ + 1); }
  /// The part on [begin, end], reparametrised to [0,1].
  Bernstein between(double begin, double end) const;
  /// With respect to u.
  Bernstein derivative() const;
  /// Appends every u in (0,1) where the sign changes, to within `narrowest`. Coefficients of magnitude up to
  /// `noise` count as 0. Only double roots that rounding creates or hides may be reported wrongly or missed.
  void appendSignChanges(double noise, std::vector<double>& roots, double narrowest = kNarrowest) const;

  Bernstein operator*(const Bernstein& other) const;
  Bernstein operator*(double factor) const;
  Bernstein operator+(const Bernstein& other) const;
  Bernstein operator-(const Bernstein& other) const { return *this + other * -1; }
  Bernstein operator-(double value) const;

 private:
  Bernstein elevated(std::size_t degree) const;
  void splitAt(double u, Bernstein& left, Bernstein& right) const;
  void appendSignChanges(double noise, double narrowest, double begin, double end,
                         std::vector<double>& roots) const;
  std::size_t degree_;
  std::array<double, kMaxDegree + 1> b_{};
};

}  // namespace scolopax::reference
