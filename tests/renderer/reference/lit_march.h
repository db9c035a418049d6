// SPDX-License-Identifier: Apache-2.0
// The simplest program for a lit ray: tiny steps, and a bound on the error of the steps. Surfaces are those
// of isovalues; they cast no shadows here. Shares no code with the renderer.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <utility>
#include <vector>

#include "tests/renderer/reference/point_scene.h"

namespace scolopax::reference {

struct March {
  glm::dvec4 rgba{0};
  /// Bound on each component's error: the midpoint rule is off by at most step / 4 times the sum of the
  /// second differences, at jumps, at kinks and in smooth parts.
  double bound = 0;
};

class LitMarcher : PointScene {
 public:
  using PointScene::PointScene;

  March march(const glm::dvec3& origin, const glm::dvec3& direction, int steps, int shadowSteps = 0) const {
    March result;
    if (scene_.blend != BlendMode::composite) return march(origin, direction, steps, shadowSteps, -1);
    double transmittance = 1;
    for (int n = 0; n < int(fields_.size()); ++n) {
      const March one = march(origin, direction, steps, shadowSteps, n);
      result.rgba += glm::dvec4(glm::dvec3(one.rgba), 0);
      transmittance *= 1 - one.rgba.a;
      result.bound += one.bound;
    }
    result.rgba.a = 1 - transmittance;
    return result;
  }

 private:
  /// On which side of each isovalue a ray was last; unknown where there is no value.
  using Sides = std::map<std::pair<std::size_t, std::size_t>, bool>;

  /// Calls visit(channel, isovalue) for every surface that lies between the last point and this one.
  template <class Visit>
  void forEachMet(const glm::dvec3& point, int only, Sides& sides, const Visit& visit) const {
    for (std::size_t n = 0; n < fields_.size(); ++n) {
      if (!scene_.channels[n].visible || (only >= 0 && int(n) != only)) continue;
      for (std::size_t k = 0; k < scene_.channels[n].isovalues.size(); ++k) {
        const double s = scalar(n, point);
        const Isovalue& isovalue = scene_.channels[n].isovalues[k];
        const auto last = sides.find({n, k});
        if (last != sides.end() && std::isfinite(s) && last->second != (s >= isovalue.value))
          visit(n, isovalue);
        sides.erase({n, k});
        if (std::isfinite(s)) sides[{n, k}] = s >= isovalue.value;
      }
    }
  }

  March march(const glm::dvec3& originWorld, const glm::dvec3& directionWorld, int steps, int shadowSteps,
              int only) const {
    March result;
    const glm::dvec3 direction = glm::normalize(directionWorld);
    const glm::dvec3 o = voxelFromWorld_ * (originWorld - zero_), d = voxelFromWorld_ * direction;
    double begin, end, depth = 0, lightBound = 0, extinctionBefore = 0;
    if (!clip(o, d, 1e9, begin, end)) return result;
    const double dt = (end - begin) / steps;
    glm::dvec3 color(0);
    SecondDifferences bends[4];
    Sides sides;
    for (int i = 0; i < steps; ++i) {
      const double t = begin + (i + 0.5) * dt;
      const glm::dvec3 point = o + t * d, world = originWorld + t * direction;
      const Sigmas sigma = sigmas(point, only);
      const double extinction = blended(sigma);
      const std::size_t largest = std::size_t(std::max_element(sigma.begin(), sigma.end()) - sigma.begin());
      glm::dvec3 emission(0);
      double shadowBound = 0;
      std::vector<Arriving> lights;
      if (extinction > 0) lights = arriving(world, direction, t, shadowSteps, only, shadowBound);
      forEachMet(point, only, sides, [&](std::size_t n, const Isovalue& isovalue) {
        // The surface is somewhere in a step, so both ends of the step are tried.
        const glm::dvec3 own = isovalue.color ? *isovalue.color : colorOf(n, isovalue.value);
        const auto seenAt = [&](double at) {
          return radiance(
              n, o + at * d, own, true, -direction,
              arriving(originWorld + at * direction, direction, at, shadowSteps, only, lightBound));
        };
        const glm::dvec3 seen = seenAt(t), difference = glm::abs(seen - seenAt(t - dt));
        const double passes = std::exp(-depth), matter = (extinctionBefore + extinction) * dt;
        color += passes * isovalue.opacity * seen;
        lightBound +=
            passes * isovalue.opacity * (std::max({difference.x, difference.y, difference.z}) + 4 * matter);
        depth -= std::log1p(-isovalue.opacity);
      });
      extinctionBefore = extinction;
      for (std::size_t n = 0; n < fields_.size(); ++n) {
        double share = sigma[n];
        if (scene_.blend == BlendMode::max && n != largest) share = 0;
        if (scene_.blend == BlendMode::mix) share *= scene_.channels[n].weight;
        if (share > 0)
          emission += share * radiance(n, point, colorOf(n, scalar(n, point)), false, -direction, lights);
      }
      const glm::dvec3 seen = std::exp(-depth - 0.5 * extinction * dt) * emission;
      color += dt * seen;
      lightBound += dt * std::exp(-depth) * extinction * shadowBound;
      depth += extinction * dt;
      for (int c = 0; c < 4; ++c) {
        const double value = c < 3 ? seen[c] : extinction;
        if (i == 0) bends[c].before = bends[c].last = value;
        bends[c].add(value);
      }
    }
    result.rgba = glm::dvec4(color, -std::expm1(-depth));
    const double depthBound = 0.25 * dt * bends[3].sum;
    for (int c = 0; c < 3; ++c)
      result.bound = std::max(result.bound, 0.25 * dt * bends[c].sum + depthBound * color[c] + lightBound);
    result.bound = std::max(result.bound, depthBound) + 1e-9;
    return result;
  }
};

}  // namespace scolopax::reference
