// SPDX-License-Identifier: Apache-2.0
// Hydrogen probability densities |psi_nlm|^2: the demo data set, and a test volume whose exact value and
// gradient are known at every point.
#pragma once
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "renderer/data/volume.h"

namespace scolopax {

/// |psi_nlm|^2 of the eigenstates of energy, L^2 and L_z, in atomic units (a0 = 1, nuclear charge 1):
///   psi_nlm = sqrt((2/n)^3 (n-l-1)! / (2n (n+l)!)) (2r/n)^l e^(-r/n) L_{n-l-1}^{2l+1}(2r/n) Y_lm
/// with generalised Laguerre polynomials L and spherical harmonics Y; its integral over space is 1. The
/// density is symmetric about z. It is evaluated as powers of x^2+y^2, z and r, without angles, so that
/// nothing is singular on the axis or at the origin.
class HydrogenOrbital {
 public:
  static constexpr int kMaxN = 10;
  /// 1 <= n <= kMaxN, 0 <= l < n, |m| <= l; throws Error(badInput) otherwise.
  HydrogenOrbital(int n, int l, int m);

  /// Probability density at `p` (a0), in a0^-3.
  double density(const glm::dvec3& p) const;
  /// Its gradient, in a0^-4. An s state (l = 0) has a cusp at the origin; there the result is 0, the mean
  /// over all directions.
  glm::dvec3 gradient(const glm::dvec3& p) const;
  /// Spectroscopic name, such as "3d m=1".
  std::string name() const;

 private:
  int n_, l_, m_;                // m_ is not negative: the density depends on |m| alone
  double norm_;                  // constant factor of the density
  std::vector<double> angular_;  // d^m P_l / dx^m = sum_k angular_[k] x^(l-m-2k)
};

struct GeneratedVolume {
  Grid grid;
  std::vector<ChannelSource> channels;
};

inline constexpr int kMaxOrbitals = 12;
/// Half the edge of the box that generateOrbitals fills, in a0.
inline constexpr double kOrbitalBoxHalfEdge = 36;

/// The state in channel i of generateOrbitals; 0 <= i < kMaxOrbitals.
HydrogenOrbital demoOrbital(int i);

/// `channels` states (1..kMaxOrbitals) on size^3 voxels (size 2..1024) of u16 that fill a cube centred at 0.
/// In each channel the largest voxel is stored as 65535, and the slope converts stored values to densities in
/// a0^-3. Throws Error(badInput) for other arguments.
GeneratedVolume generateOrbitals(int size = 128, int channels = 4);

}  // namespace scolopax
