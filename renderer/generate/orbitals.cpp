// SPDX-License-Identifier: Apache-2.0
#include "renderer/generate/orbitals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "renderer/core/error.h"

namespace scolopax {
namespace {

double factorial(int n) { return std::tgamma(n + 1.0); }

double power(double x, int n) {
  double result = 1;
  for (; n > 0; --n) result *= x;
  return result;
}

/// Generalised Laguerre polynomial L_k^a(x) by its three-term recurrence (DLMF 18.9.13); 0 for k < 0.
double laguerre(int k, int a, double x) {
  if (k < 0) return 0;
  double previous = 0, current = 1;
  for (int i = 1; i <= k; ++i) {
    const double next = ((2 * i - 1 + a - x) * current - (i - 1 + a) * previous) / i;
    previous = current;
    current = next;
  }
  return current;
}

/// States whose lobes interleave inside one box; neighbours in the list are of similar size.
constexpr struct {
  int n, l, m;
} kDemoStates[kMaxOrbitals] = {{4, 3, 0}, {4, 3, 3}, {3, 2, 1}, {3, 2, 0}, {4, 3, 1}, {2, 1, 0},
                               {4, 3, 2}, {4, 2, 1}, {3, 2, 2}, {2, 1, 1}, {4, 2, 0}, {3, 1, 0}};

}  // namespace

HydrogenOrbital::HydrogenOrbital(int n, int l, int m) : n_(n), l_(l), m_(std::abs(m)) {
  if (n < 1 || n > kMaxN || l < 0 || l >= n || m_ > l)
    throw Error(ErrorCode::badInput,
                "orbital: expected 1 <= n <= 10, 0 <= l < n, |m| <= l, found n=" + std::to_string(n) +
                    " l=" + std::to_string(l) + " m=" + std::to_string(m));
  // The r^l of the radial part's (2r/n)^l moves into the solid harmonic below; its (2/n)^l stays here.
  const double radial = power(2.0 / n, 3 + 2 * l) * factorial(n - l - 1) / (2 * n * factorial(n + l));
  const double angular = (2 * l + 1) / (4 * std::numbers::pi) * factorial(l - m_) / factorial(l + m_);
  norm_ = radial * angular;
  for (int k = 0; 2 * k <= l - m_; ++k)
    angular_.push_back((k % 2 ? -1 : 1) * factorial(2 * l - 2 * k) /
                       (power(2, l) * factorial(k) * factorial(l - k) * factorial(l - m_ - 2 * k)));
}

// density = norm F(r) G(x,y,z)^2 with F = (e^(-r/n) L(2r/n))^2 and the solid harmonic
// G = (x^2+y^2)^(m/2) sum_k angular_k z^(l-m-2k) r^(2k).
double HydrogenOrbital::density(const glm::dvec3& p) const {
  const double rho2 = p.x * p.x + p.y * p.y, r2 = rho2 + p.z * p.z, r = std::sqrt(r2);
  double sum = 0;
  for (int k = 0; k < int(angular_.size()); ++k)
    sum += angular_[std::size_t(k)] * power(p.z, l_ - m_ - 2 * k) * power(r2, k);
  const double radial = std::exp(-r / n_) * laguerre(n_ - l_ - 1, 2 * l_ + 1, 2 * r / n_);
  return norm_ * power(rho2, m_) * radial * radial * sum * sum;
}

glm::dvec3 HydrogenOrbital::gradient(const glm::dvec3& p) const {
  const double rho2 = p.x * p.x + p.y * p.y, r2 = rho2 + p.z * p.z, r = std::sqrt(r2);
  // The sum S(z, r^2) and its partial derivatives; no negative power of 0 occurs.
  double sum = 0, sumZ = 0, sumR2 = 0;
  for (int k = 0; k < int(angular_.size()); ++k) {
    const double a = angular_[std::size_t(k)];
    const int degree = l_ - m_ - 2 * k;
    sum += a * power(p.z, degree) * power(r2, k);
    if (degree > 0) sumZ += a * degree * power(p.z, degree - 1) * power(r2, k);
    if (k > 0) sumR2 += a * power(p.z, degree) * k * power(r2, k - 1);
  }
  const int order = n_ - l_ - 1, alpha = 2 * l_ + 1;
  const double x = 2 * r / n_, e = std::exp(-r / n_);
  const double radial = e * laguerre(order, alpha, x);
  // d/dx L_k^a = -L_{k-1}^{a+1}
  const double radialD = -(radial + 2 * e * laguerre(order - 1, alpha + 1, x)) / n_;
  const double rhoM = power(rho2, m_);

  // Three factors: rho^(2m), radial^2, S^2.
  glm::dvec3 result = p * (r > 0 ? 2 * radial * radialD * rhoM * sum * sum / r : 0.0);
  if (m_ > 0)
    result += glm::dvec3(p.x, p.y, 0) * (2 * m_ * power(rho2, m_ - 1) * radial * radial * sum * sum);
  const double common = 2 * rhoM * radial * radial * sum;
  result += glm::dvec3(0, 0, common * sumZ) + p * (common * 2 * sumR2);
  return norm_ * result;
}

std::string HydrogenOrbital::name() const {
  return std::to_string(n_) + "spdfghiklm"[l_] + " m=" + std::to_string(m_);
}

HydrogenOrbital demoOrbital(int i) {
  const auto& state = kDemoStates[i];
  return {state.n, state.l, state.m};
}

GeneratedVolume generateOrbitals(int size, int channels) {
  if (size < 2 || size > 1024)
    throw Error(ErrorCode::badInput,
                "orbitals: expected a size from 2 to 1024, found " + std::to_string(size));
  if (channels < 1 || channels > kMaxOrbitals)
    throw Error(ErrorCode::badInput, "orbitals: expected 1 to " + std::to_string(kMaxOrbitals) +
                                         " channels, found " + std::to_string(channels));
  const double spacing = 2 * kOrbitalBoxHalfEdge / size;
  const double first = 0.5 * spacing - kOrbitalBoxHalfEdge;  // the box ends half a voxel beyond the centres
  GeneratedVolume result;
  result.grid.dims = glm::ivec3(size);
  for (int axis = 0; axis < 3; ++axis) {
    result.grid.worldFromVoxel[axis][axis] = spacing;
    result.grid.worldFromVoxel[3][axis] = first;
  }
  const auto centre = [&](int i) { return first + i * spacing; };

  for (int c = 0; c < channels; ++c) {
    const HydrogenOrbital orbital = demoOrbital(c);
    // The density is even in x, y and z: its largest voxel is found in one octant.
    const double largest = tbb::parallel_reduce(
        tbb::blocked_range<int>(size / 2, size), 0.0,
        [&](const tbb::blocked_range<int>& slices, double value) {
          for (int k = slices.begin(); k < slices.end(); ++k)
            for (int j = size / 2; j < size; ++j)
              for (int i = j; i < size; ++i)
                value = std::max(value, orbital.density({centre(i), centre(j), centre(k)}));
          return value;
        },
        [](double a, double b) { return std::max(a, b); });

    ChannelSource channel;
    channel.name = orbital.name();
    channel.unit = "a0^-3";
    channel.slope = largest > 0 ? largest / 65535 : 1.0;  // every centre may lie on a nodal surface
    channel.voxels = VoxelBuffer(ScalarType::u16, result.grid.voxelCount());
    const auto voxels = channel.voxels.as<std::uint16_t>();
    tbb::parallel_for(0, size, [&](int k) {
      auto* out = voxels.data() + std::size_t(k) * std::size_t(size) * std::size_t(size);
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
          const double value = orbital.density({centre(i), centre(j), centre(k)}) / channel.slope;
          *out++ = std::uint16_t(std::min(std::lround(value), 65535L));
        }
    });
    result.channels.push_back(std::move(channel));
  }
  return result;
}

}  // namespace scolopax
