// SPDX-License-Identifier: Apache-2.0
// The simplest program for a lit ray: tiny steps, every formula written again, and a bound on the error of
// the steps. Shares no code with the renderer.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::reference {

struct March {
  glm::dvec4 rgba{0};
  /// Bound on each component's error: the midpoint rule is off by at most step / 4 times the sum of the
  /// second differences, at jumps, at kinks and in smooth parts.
  double bound = 0;
};

class LitMarcher {
 public:
  LitMarcher(const Volume& volume, const Scene& scene)
      : scene_(scene), dims_(volume.grid().dims), worldFromVoxel_(volume.grid().worldFromVoxel) {
    zero_ = glm::dvec3(volume.grid().worldFromVoxel[3]);
    voxelFromWorld_ = glm::inverse(worldFromVoxel_);
    for (const Channel& channel : volume.channels()) {
      std::vector<double> values(channel.voxels.count());
      visitScalarType(channel.voxels.type(), [&](auto zero) {
        const auto voxels = channel.voxels.as<decltype(zero)>();
        for (std::size_t i = 0; i < values.size(); ++i)
          values[i] = channel.slope * double(voxels[i]) + channel.intercept;
      });
      fields_.push_back(std::move(values));
    }
    smallestSpacing_ = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      smallestSpacing_ = std::min(smallestSpacing_, glm::length(worldFromVoxel_[axis]));
    if (scene_.lights.empty()) scene_.lights.resize(1);
  }

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
  using Sigmas = std::array<double, kMaxChannels>;

  /// Sums the second differences of successive values, for the error bound of the midpoint rule.
  struct SecondDifferences {
    double before = 0, last = 0, sum = 0;
    void add(double value) {
      sum += std::abs(value - 2 * last + before);
      before = last;
      last = value;
    }
  };

  double scalar(std::size_t n, const glm::dvec3& point) const {
    double sum = 0;
    const glm::dvec3 p = glm::clamp(point, glm::dvec3(0), glm::dvec3(dims_ - 1));
    const glm::dvec3 low = glm::max(glm::min(glm::floor(p), glm::dvec3(dims_) - 2.0), 0.0);
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      int index[3];
      for (int axis = 0; axis < 3; ++axis) {
        const int bit = corner >> axis & 1;
        weight *= bit ? p[axis] - low[axis] : 1 - (p[axis] - low[axis]);
        index[axis] = std::min(int(low[axis]) + bit, dims_[axis] - 1);
      }
      // A corner that is not finite counts, even with weight 0.
      sum += weight * fields_[n][std::size_t(index[0] + dims_.x * (index[1] + dims_.y * index[2]))];
    }
    return sum;
  }

  /// In world space; none if a difference is not finite.
  std::optional<glm::dvec3> gradient(std::size_t n, const glm::dvec3& point) const {
    glm::dvec3 perVoxel(0);
    const glm::dvec3 last(dims_ - 1), p = glm::clamp(point, glm::dvec3(0), last);
    for (int axis = 0; axis < 3; ++axis) {
      if (dims_[axis] == 1) continue;
      glm::dvec3 before = p, after = p;
      before[axis] = std::max(p[axis] - 1, 0.0);
      after[axis] = std::min(p[axis] + 1, last[axis]);
      perVoxel[axis] = (scalar(n, after) - scalar(n, before)) / (after[axis] - before[axis]);
      if (!std::isfinite(perVoxel[axis])) return std::nullopt;
    }
    return glm::transpose(voxelFromWorld_) * perVoxel;
  }

  /// Value of a curve; of two knots at one position the later counts.
  template <class Knots, class Get>
  static auto curve(const Knots& knots, double position, Get value) {
    for (std::size_t i = knots.size(); i-- > 0;)
      if (knots[i].position <= position) {
        if (i + 1 == knots.size()) return value(knots[i]);
        const double w = (position - knots[i].position) / (knots[i + 1].position - knots[i].position);
        return value(knots[i]) * (1 - w) + value(knots[i + 1]) * w;
      }
    return value(knots[0]);
  }
  double position(const ChannelAppearance& a, double s) const {
    if (a.rangeLo == a.rangeHi) return s < a.rangeLo ? 0 : 1;
    return std::pow(std::clamp((s - a.rangeLo) / (a.rangeHi - a.rangeLo), 0.0, 1.0), a.gamma);
  }

  /// The factor of the opacity, from |gradient|.
  double factor(std::size_t n, const glm::dvec3& point) const {
    const std::optional<GradientOpacity>& by = scene_.channels[n].gradientOpacity;
    if (!by) return 1;
    const std::optional<glm::dvec3> g = gradient(n, point);
    if (!g) return 0;
    const double lo = by->rangeLo, hi = by->rangeHi, magnitude = glm::length(*g);
    const double at = lo == hi ? double(magnitude >= lo) : std::clamp((magnitude - lo) / (hi - lo), 0.0, 1.0);
    return curve(by->factor, at, [](const OpacityKnot& k) { return k.value; });
  }

  /// Extinction of every channel at a point; only of channel `only` if that is not -1.
  Sigmas sigmas(const glm::dvec3& point, int only) const {
    Sigmas sigma{};
    for (std::size_t n = 0; n < fields_.size(); ++n) {
      const ChannelAppearance& a = scene_.channels[n];
      const double s = scalar(n, point);
      if (!a.visible || (only >= 0 && int(n) != only) || !std::isfinite(s)) continue;
      sigma[n] = a.density * factor(n, point) *
                 curve(a.opacity, position(a, s), [](const OpacityKnot& k) { return k.value; });
    }
    return sigma;
  }
  double blended(const Sigmas& sigma) const {
    double sum = 0, most = 0;
    for (const double s : sigma) sum += s, most = std::max(most, s);
    return scene_.blend == BlendMode::max || scene_.blend == BlendMode::mix ? most : sum;
  }

  /// The part [begin, end] of t in [0, length] in which the ray is inside the box; false if there is none.
  bool clip(const glm::dvec3& o, const glm::dvec3& d, double length, double& begin, double& end) const {
    begin = 0;
    end = length;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = -0.5 - o[axis], high = dims_[axis] - 0.5 - o[axis];
      if (d[axis] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      begin = std::max(begin, std::min(low / d[axis], high / d[axis]));
      end = std::min(end, std::max(low / d[axis], high / d[axis]));
    }
    return begin < end;
  }

  /// Transmittance between a world point and a light. Sets `bound` to the possible error by its steps.
  double visibility(const glm::dvec3& point, const glm::dvec3& direction, double distance, int steps,
                    int only, double& bound) const {
    const glm::dvec3 o = voxelFromWorld_ * (point - zero_), d = voxelFromWorld_ * direction;
    double begin, end, depth = 0;
    if (!clip(o, d, distance, begin, end)) return 1;
    const double dt = (end - begin) / steps;
    SecondDifferences bend;
    for (int i = 0; i < steps; ++i) {
      const double sigma = blended(sigmas(o + (begin + (i + 0.5) * dt) * d, only));
      depth += sigma * dt;
      if (i == 0) bend.before = bend.last = sigma;
      bend.add(sigma);
    }
    bound = std::exp(-depth) * std::expm1(std::min(50.0, 0.25 * dt * bend.sum));
    return std::exp(-depth);
  }

  /// One light's contribution at a point.
  struct Arriving {
    glm::dvec3 l, intensity, reaching;
  };

  glm::dvec3 radiance(std::size_t n, const glm::dvec3& point, double s, const glm::dvec3& v,
                      const std::vector<Arriving>& lights) const {
    const ChannelAppearance& a = scene_.channels[n];
    const Material& m = a.material;
    const glm::dvec3 color = curve(a.color, position(a, s), [](const ColorKnot& k) { return k.color; });
    glm::dvec3 all(0), seen(0), diffuse(0), specular(0);
    const glm::dvec3 grad = scene_.shading ? gradient(n, point).value_or(glm::dvec3(0)) : glm::dvec3(0);
    const double change = glm::length(grad) * smallestSpacing_, range = std::abs(a.rangeHi - a.rangeLo);
    const double g = change > 0 ? std::min(1.0, change / range) : 0, fade = 1 - (1 - g) * (1 - g);
    glm::dvec3 normal = change > 0 ? grad / glm::length(grad) : glm::dvec3(0);
    if (glm::dot(normal, v) < 0) normal = -normal;
    for (const Arriving& light : lights) {
      all += light.intensity;
      seen += light.reaching;
      diffuse += light.reaching * std::max(glm::dot(normal, light.l), 0.0);
      const glm::dvec3 h = light.l + v;
      if (glm::length(h) > 0)
        specular +=
            light.reaching * std::pow(std::max(glm::dot(normal, h / glm::length(h)), 0.0), m.shininess);
    }
    glm::dvec3 plain(1);
    for (int c = 0; c < 3; ++c)
      if (scene_.shadows && all[c] > 0) plain[c] = m.ambient + (1 - m.ambient) * seen[c] / all[c];
    return color * ((1 - fade) * plain + fade * (m.ambient + m.diffuse * diffuse)) +
           fade * m.specular * specular;
  }

  March march(const glm::dvec3& originWorld, const glm::dvec3& directionWorld, int steps, int shadowSteps,
              int only) const {
    March result;
    const glm::dvec3 direction = glm::normalize(directionWorld);
    const glm::dvec3 o = voxelFromWorld_ * (originWorld - zero_), d = voxelFromWorld_ * direction;
    double begin, end, depth = 0, lightBound = 0;
    if (!clip(o, d, 1e9, begin, end)) return result;
    const double dt = (end - begin) / steps;
    glm::dvec3 color(0);
    SecondDifferences bends[4];
    std::vector<Arriving> lights(scene_.lights.size());
    for (int i = 0; i < steps; ++i) {
      const double t = begin + (i + 0.5) * dt;
      const glm::dvec3 point = o + t * d, world = originWorld + t * direction;
      const Sigmas sigma = sigmas(point, only);
      const double extinction = blended(sigma);
      const std::size_t largest = std::size_t(std::max_element(sigma.begin(), sigma.end()) - sigma.begin());
      glm::dvec3 emission(0);
      double shadowBound = 0;
      if (extinction > 0)
        for (std::size_t k = 0; k < lights.size(); ++k) {
          const Light& light = scene_.lights[k];
          glm::dvec3 to = -light.vector;
          double distance = 1e9;
          if (light.type == LightType::point) to = light.vector - world, distance = glm::length(to);
          if (light.type == LightType::headlight) to = -direction, distance = t;
          lights[k].l = glm::length(to) > 0 ? glm::normalize(to) : glm::dvec3(0);
          lights[k].intensity = lights[k].reaching = light.color * light.intensity;
          if (!scene_.shadows) continue;
          double bound = 0;
          lights[k].reaching *= visibility(world, lights[k].l, distance, shadowSteps, only, bound);
          shadowBound += bound;
        }
      for (std::size_t n = 0; n < fields_.size(); ++n) {
        double share = sigma[n];
        if (scene_.blend == BlendMode::max && n != largest) share = 0;
        if (scene_.blend == BlendMode::mix) share *= scene_.channels[n].weight;
        if (share > 0) emission += share * radiance(n, point, scalar(n, point), -direction, lights);
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

  Scene scene_;
  glm::ivec3 dims_;
  glm::dmat3 worldFromVoxel_, voxelFromWorld_;
  glm::dvec3 zero_;
  double smallestSpacing_;
  std::vector<std::vector<double>> fields_;
};

}  // namespace scolopax::reference
