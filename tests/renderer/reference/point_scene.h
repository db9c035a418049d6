// SPDX-License-Identifier: Apache-2.0
// A scene at points of a volume, for sums over tiny steps. Every formula is written again; shares no code
// with the renderer.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "tests/renderer/reference/point_field.h"

namespace scolopax::reference {

/// Sums the second differences of successive values, for the error bound of the midpoint rule.
struct SecondDifferences {
  double before = 0, last = 0, sum = 0;
  void add(double value) {
    sum += std::abs(value - 2 * last + before);
    before = last;
    last = value;
  }
};

class PointScene {
 public:
  using Sigmas = std::array<double, kMaxChannels>;

  PointScene(const Volume& volume, const Scene& scene)
      : scene_(scene), dims_(volume.grid().dims), worldFromVoxel_(volume.grid().worldFromVoxel) {
    zero_ = glm::dvec3(volume.grid().worldFromVoxel[3]);
    voxelFromWorld_ = glm::inverse(worldFromVoxel_);
    for (std::size_t n = 0; n < volume.channels().size(); ++n)
      fields_.emplace_back(volume.channels()[n], dims_, scene.channels[n].interpolation);
    smallestSpacing_ = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      smallestSpacing_ = std::min(smallestSpacing_, glm::length(worldFromVoxel_[axis]));
    if (scene_.lights.empty()) scene_.lights.resize(1);
  }

  double scalar(std::size_t n, const glm::dvec3& point) const { return fields_[n].scalar(point); }

  /// In world space; none if it is not finite.
  std::optional<glm::dvec3> gradient(std::size_t n, const glm::dvec3& point) const {
    const std::optional<glm::dvec3> perVoxel = fields_[n].gradient(point);
    if (!perVoxel) return std::nullopt;
    return glm::transpose(voxelFromWorld_) * *perVoxel;
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

  /// All lights at a world point on a ray; adds to `bound` the possible error of their shadows.
  std::vector<Arriving> arriving(const glm::dvec3& world, const glm::dvec3& direction, double t,
                                 int shadowSteps, int only, double& bound) const {
    std::vector<Arriving> lights;
    for (const Light& light : scene_.lights) {
      glm::dvec3 to = -light.vector;
      double distance = 1e9;
      if (light.type == LightType::point) to = light.vector - world, distance = glm::length(to);
      if (light.type == LightType::headlight) to = -direction, distance = t;
      const glm::dvec3 l = glm::length(to) > 0 ? glm::normalize(to) : glm::dvec3(0);
      const glm::dvec3 intensity = light.color * light.intensity;
      double error = 0;
      const double visible = scene_.shadows ? visibility(world, l, distance, shadowSteps, only, error) : 1;
      lights.push_back({l, intensity, intensity * visible});
      bound += error;
    }
    return lights;
  }

  glm::dvec3 colorOf(std::size_t n, double s) const {
    const ChannelAppearance& a = scene_.channels[n];
    return curve(a.color, position(a, s), [](const ColorKnot& k) { return k.color; });
  }

  /// `full`: as of a surface, without fade.
  glm::dvec3 radiance(std::size_t n, const glm::dvec3& point, const glm::dvec3& color, bool full,
                      const glm::dvec3& v, const std::vector<Arriving>& lights) const {
    const ChannelAppearance& a = scene_.channels[n];
    const Material& m = a.material;
    glm::dvec3 all(0), seen(0), diffuse(0), specular(0);
    const glm::dvec3 grad = scene_.shading ? gradient(n, point).value_or(glm::dvec3(0)) : glm::dvec3(0);
    const double change = glm::length(grad) * smallestSpacing_, range = std::abs(a.rangeHi - a.rangeLo);
    const double steep = full ? 1 : std::min(1.0, change / range);
    const double g = change > 0 ? steep : 0, fade = 1 - (1 - g) * (1 - g);
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

 protected:
  Scene scene_;
  glm::ivec3 dims_;
  glm::dmat3 worldFromVoxel_, voxelFromWorld_;
  glm::dvec3 zero_;
  double smallestSpacing_;
  std::vector<PointField> fields_;
};

}  // namespace scolopax::reference
