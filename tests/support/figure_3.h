// SPDX-License-Identifier: Apache-2.0
// Figure 3 of the paper: three cubes with linear densities (red decreases along x, green along -x, blue along
// -y), and the unlit radiance of rays through them in closed form.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/volumes.h"

namespace scolopax::test {

struct Figure3 {
  static constexpr int n = 16;             ///< voxels along an edge
  static constexpr double density = 0.15;  ///< at the dense end
  static constexpr double blueWeight = 0.5;

  /// Colour and alpha of a ray. `direction` has length 1 and no component that is 0.
  static glm::dvec4 seen(BlendMode mode, const glm::dvec3& origin, const glm::dvec3& direction) {
    if (mode == BlendMode::composite) {
      glm::dvec4 sum(0, 0, 0, 1);
      for (int c = 0; c < 3; ++c) {
        double depth = 0;
        forEachPiece(origin, direction,
                     [&](const Piece& p) { depth += 0.5 * (p.begin[c] + p.end[c]) * p.length; });
        sum[c] = -std::expm1(-depth);
        sum.a *= std::exp(-depth);
      }
      return {glm::dvec3(sum), 1 - sum.a};
    }
    double transmittance = 1;
    glm::dvec3 color(0);
    forEachPiece(origin, direction, [&](const Piece& p) {
      const auto blended = [&](const glm::dvec3& s) {
        return mode == BlendMode::density ? s.x + s.y + s.z : std::max({s.x, s.y, s.z});
      };
      const double s0 = blended(p.begin), s1 = (blended(p.end) - s0) / p.length;
      const glm::dvec3 middle = 0.5 * (p.begin + p.end);
      for (int c = 0; c < 3; ++c) {
        double share = mode == BlendMode::mix && c == 2 ? blueWeight : 1;
        if (mode == BlendMode::max && c != largestOf(middle)) share = 0;
        const double slope = (p.end[c] - p.begin[c]) / p.length;
        if (share > 0) color[c] += share * transmittance * absorbed(p.begin[c], slope, s0, s1, p.length);
      }
      transmittance *= std::exp(-(s0 + 0.5 * s1 * p.length) * p.length);
    });
    return {color, 1 - transmittance};
  }

  static std::shared_ptr<const Volume> volume() {
    const glm::ivec3 dims(n);
    return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int, int) { return n - 1 - x; }),
                    channelOf<std::uint8_t>(dims, [](int x, int, int) { return x; }),
                    channelOf<std::uint8_t>(dims, [](int, int y, int) { return y; }));
  }
  static Scene scene() {
    Scene scene;
    for (int c = 0; c < 3; ++c) {
      ChannelAppearance& a = scene.channels.emplace_back();
      a.rangeHi = n - 1;
      a.density = density;
      a.color = {{0, glm::dvec3(c == 0, c == 1, c == 2)}};
    }
    scene.channels[2].weight = blueWeight;
    scene.camera.target = glm::dvec3(0.5 * (n - 1));
    scene.camera.eye = scene.camera.target - 40.0 * direction();
    scene.camera.orthoHeight = 22;
    scene.filter = PixelFilter::point;
    return scene;
  }
  /// Direction of the parallel rays of scene(): from below, so that blue becomes denser along them.
  static glm::dvec3 direction() { return glm::dvec3(-2, 1, 1.5) / std::sqrt(7.25); }
  /// Origin of the ray through the centre of pixel (x, y).
  static glm::dvec3 origin(const Scene& scene, int x, int y) {
    const glm::dvec3 d = direction(), across(-d.z, 0, d.x);  // right: direction x up, up being +y
    const glm::dvec3 right = across / std::sqrt(across.x * across.x + across.z * across.z);
    const glm::dvec3 up(right.y * d.z - right.z * d.y, right.z * d.x - right.x * d.z,
                        right.x * d.y - right.y * d.x);
    const double pixel = *scene.camera.orthoHeight / scene.height;
    return scene.camera.eye + (x + 0.5 - 0.5 * scene.width) * pixel * right +
           (0.5 * scene.height - y - 0.5) * pixel * up;
  }

 private:
  /// Part of a ray. Extinctions of the channels at both ends, linear in between; the order of the channels by
  /// extinction does not change within it.
  struct Piece {
    double length;
    glm::dvec3 begin, end;
  };
  static glm::dvec3 extinctions(const glm::dvec3& p) {
    const double x = std::clamp(p.x / (n - 1), 0.0, 1.0), y = std::clamp(p.y / (n - 1), 0.0, 1.0);
    return density * glm::dvec3(1 - x, x, y);
  }
  /// Index of the largest extinction, of equal ones the first: in the outer half voxels blue can be as dense
  /// as red or green.
  static int largestOf(const glm::dvec3& s) {
    constexpr double kRounding = 1e-12;
    return s.x >= s.y - kRounding && s.x >= s.z - kRounding ? 0 : (s.y >= s.z - kRounding ? 1 : 2);
  }
  /// Cuts the ray where it enters and leaves the box, at the outer voxel centres, and where two channels are
  /// equal.
  template <class Visit>
  static void forEachPiece(const glm::dvec3& origin, const glm::dvec3& direction, Visit&& visit) {
    double enter = 0, exit = 1e9;
    std::vector<double> cuts;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (-0.5 - origin[axis]) / direction[axis],
                   b = (n - 0.5 - origin[axis]) / direction[axis];
      enter = std::max(enter, std::min(a, b));
      exit = std::min(exit, std::max(a, b));
      for (const double plane : {0.0, double(n - 1)})
        cuts.push_back((plane - origin[axis]) / direction[axis]);
    }
    if (!(enter < exit)) return;
    cuts.insert(cuts.end(), {enter, exit});
    std::sort(cuts.begin(), cuts.end());
    const auto at = [&](double t) { return extinctions(origin + t * direction); };
    const std::vector<double> planes = cuts;
    for (std::size_t i = 0; i + 1 < planes.size(); ++i) {
      const double length = planes[i + 1] - planes[i];
      const glm::dvec3 a = at(planes[i]), b = at(planes[i + 1]);
      for (const auto& [m, k] : {std::pair{0, 1}, {1, 2}, {0, 2}}) {
        const double d0 = a[m] - a[k], d1 = b[m] - b[k];
        if (d0 * d1 < 0) cuts.push_back(planes[i] + length * d0 / (d0 - d1));
      }
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
      if (cuts[i] >= enter && cuts[i + 1] <= exit && cuts[i + 1] - cuts[i] > 1e-12)
        visit(Piece{cuts[i + 1] - cuts[i], at(cuts[i]), at(cuts[i + 1])});
  }

  /// Integral over [0, h] of (p + q t) exp(-(s0 t + s1 t^2 / 2)). One part of p + q t is a multiple of the
  /// exponent's derivative; the rest gives an error function.
  static double absorbed(double p, double q, double s0, double s1, double h) {
    const double lost = -std::expm1(-(s0 + 0.5 * s1 * h) * h);
    if (std::abs(s1) < 1e-12)  // constant extinction along the ray
      return s0 > 0 ? p * lost / s0 + q * (lost / s0 - h * std::exp(-s0 * h)) / s0 : p * h + 0.5 * q * h * h;
    const double r = std::sqrt(0.5 * std::abs(s1)), from = s0 / (2 * r);
    const double rest =
        s1 > 0 ? std::exp(from * from) * (std::erf(from + r * h) - std::erf(from)) * kHalfRootPi / r
               : std::exp(-from * from) * (imaginaryErf(from) - imaginaryErf(from - r * h)) * kHalfRootPi / r;
    return q / s1 * lost + (p - q * s0 / s1) * rest;
  }
  static constexpr double kHalfRootPi = 0.88622692545275801;
  /// erfi by its series, which converges for every argument; arguments here are below 5.
  static double imaginaryErf(double x) {
    double power = x, sum = 0;
    for (int k = 0; k < 200; ++k) {
      sum += power / (2 * k + 1);
      power *= x * x / (k + 1);
    }
    return sum / kHalfRootPi;
  }
};

}  // namespace scolopax::test
