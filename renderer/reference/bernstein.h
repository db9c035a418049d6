// SPDX-License-Identifier: Apache-2.0
// Polynomials on [0,1] by their Bernstein coefficients, between whose smallest and largest all values lie;
// and where they change sign.
#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace scolopax::reference {

class Bernstein {
 public:
  static constexpr std::size_t kMaxDegree = 12;
  static constexpr double kNarrowest = 0x1p-44;  ///< bracket of a root
  /// One coefficient more than the degree. One: a constant; two: the values at 0 and 1.
  explicit Bernstein(std::span<const double> coefficients);
  Bernstein() : Bernstein(std::array{0.0}) {}

  std::size_t degree() const { return degree_; }
  std::span<const double> coefficients() const { return {b_.data(), degree_ + 1}; }
  double operator()(double u) const;
  /// Bounds over [0,1].
  double lower() const { return *std::min_element(b_.begin(), b_.begin() + degree_ + 1); }
  double upper() const { return *std::max_element(b_.begin(), b_.begin() + degree_ + 1); }
  /// The same polynomial as seen from [begin, end], stretched to [0,1].
  Bernstein between(double begin, double end) const;
  /// With respect to u.
  Bernstein derivative() const;
  /// Appends every u in (0,1) where the sign changes, to within `narrowest`. Coefficients up to `noise` count
  /// as 0; double roots that rounding makes or hides, and no others, may come in excess or not at all.
  void appendSignChanges(double noise, std::vector<double>& roots, double narrowest = kNarrowest) const;

  Bernstein operator*(const Bernstein& other) const;
  Bernstein operator*(double factor) const;
  Bernstein operator+(const Bernstein& other) const;
  Bernstein operator-(const Bernstein& other) const { return *this + other * -1; }

 private:
  Bernstein elevated(std::size_t degree) const;
  void splitAt(double u, Bernstein& left, Bernstein& right) const;
  void appendSignChanges(double noise, double narrowest, double begin, double end,
                         std::vector<double>& roots) const;
  std::size_t degree_;
  std::array<double, kMaxDegree + 1> b_{};
};

}  // namespace scolopax::reference
