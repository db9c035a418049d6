// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/cell_scalar.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/reference/lerp.h"

namespace scolopax::reference {
namespace {

double trilinear(const std::array<double, 8>& c, double x, double y, double z) {
  const double near = lerpExact(lerpExact(c[0], c[1], x), lerpExact(c[2], c[3], x), y);
  const double far = lerpExact(lerpExact(c[4], c[5], x), lerpExact(c[6], c[7], x), y);
  return lerpExact(near, far, z);
}

}  // namespace

CellScalar::CellScalar(const std::array<double, 8>& c, const glm::dvec3& p, const glm::dvec3& q) {
  // Coefficient i is the mean of the trilinear form over all choices of i axes at the end point and the
  // others at the begin point.
  b_[0] = trilinear(c, p.x, p.y, p.z);
  b_[1] = (trilinear(c, q.x, p.y, p.z) + trilinear(c, p.x, q.y, p.z) + trilinear(c, p.x, p.y, q.z)) / 3;
  b_[2] = (trilinear(c, p.x, q.y, q.z) + trilinear(c, q.x, p.y, q.z) + trilinear(c, q.x, q.y, p.z)) / 3;
  b_[3] = trilinear(c, q.x, q.y, q.z);
  // Rounding in the means must not carry a value out of the range of the corners, and so across a step of a
  // curve.
  const auto [least, most] = std::minmax_element(c.begin(), c.end());
  for (double& b : b_) b = std::clamp(b, *least, *most);
}

double CellScalar::operator()(double u) const {  // de Casteljau: exact where the scalar is constant
  const double a = lerpExact(b_[0], b_[1], u), b = lerpExact(b_[1], b_[2], u), c = lerpExact(b_[2], b_[3], u);
  return lerpExact(lerpExact(a, b, u), lerpExact(b, c, u), u);
}

double CellScalar::lower() const { return *std::min_element(b_.begin(), b_.end()); }
double CellScalar::upper() const { return *std::max_element(b_.begin(), b_.end()); }

double CellScalar::derivative(double u) const {
  const double v = 1 - u;
  return 3 * (v * v * (b_[1] - b_[0]) + 2 * u * v * (b_[2] - b_[1]) + u * u * (b_[3] - b_[2]));
}

void CellScalar::appendCrossings(double value, std::vector<double>& crossings) const {
  if (!(lower() < value && value < upper())) return;
  // The derivative a u^2 + 2 h u + c (over 3) has at most two roots, between which the scalar is monotone.
  const double c = b_[1] - b_[0], h = b_[2] - b_[1] - c, a = (b_[3] - b_[2]) - (b_[2] - b_[1]) - h;
  const double discriminant = h * h - a * c;
  std::array<double, 4> ends{0};
  std::size_t count = 1;
  if (discriminant > 0) {
    const double s = -(h + std::copysign(std::sqrt(discriminant), h));
    for (const double root : {s / a, c / s})  // one may be infinite or NaN: then it is not inside
      if (root > 0 && root < 1) ends[count++] = root;
    if (count == 3 && ends[2] < ends[1]) std::swap(ends[1], ends[2]);
  }
  ends[count] = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const double begin = (*this)(ends[i]) - value, end = (*this)(ends[i + 1]) - value;
    if ((begin < 0 && end > 0) || (begin > 0 && end < 0))
      crossings.push_back(crossingBetween(ends[i], ends[i + 1], value));
  }
}

/// Newton's method inside a bracket that bisection narrows, to the last bit.
double CellScalar::crossingBetween(double begin, double end, double value) const {
  const bool rising = (*this)(end) > value;
  double u = 0.5 * (begin + end);
  for (int step = 0; step < 200; ++step) {
    const double difference = (*this)(u)-value;
    if (difference == 0) return u;
    ((difference < 0) == rising ? begin : end) = u;
    double next = u - difference / derivative(u);
    if (!(next > begin && next < end)) next = 0.5 * (begin + end);
    if (next == u || next <= begin || next >= end) return next;
    u = next;
  }
  return u;
}

}  // namespace scolopax::reference
