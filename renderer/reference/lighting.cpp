// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/lighting.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <string>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

bool allNotNegative(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v) && v >= 0; });
}

void check(const Light& light) {
  const double length = glm::length(light.vector);
  if (!std::isfinite(length) || (light.type == LightType::directional && !(length > 0)))
    throw Error(ErrorCode::badInput,
                "reference: a light's position or direction must be finite, a direction not 0");
  if (!allNotNegative({light.color.x, light.color.y, light.color.z, light.intensity}))
    throw Error(ErrorCode::badInput,
                "reference: colour and intensity of a light must be finite and not negative");
}

void check(const Material& m) {
  if (!allNotNegative({m.ambient, m.diffuse, m.specular, m.shininess}) || !(m.shininess > 0))
    throw Error(ErrorCode::badInput, "reference: a material must be finite and not negative, shininess > 0");
}

}  // namespace

glm::dvec3 unit(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : glm::dvec3(0);
}

Lighting::Lighting(const Scene& scene, const glm::dvec3& zero)
    : shading_(scene.shading), shadows_(scene.shadows), lights_(scene.lights) {
  if (lights_.empty()) lights_.resize(1);  // a headlight
  for (Light& light : lights_) {
    check(light);
    if (light.type == LightType::point) light.vector -= zero;
  }
  for (const ChannelAppearance& channel : scene.channels) check(channel.material);
}

std::vector<ArrivingLight> Lighting::arriving(const glm::dvec3& point, const glm::dvec3& eye) const {
  std::vector<ArrivingLight> result;
  for (const Light& light : lights_) {
    const glm::dvec3 intensity = light.color * light.intensity;
    switch (light.type) {
      case LightType::directional:
        result.push_back({-unit(light.vector), std::numeric_limits<double>::infinity(), intensity});
        break;
      case LightType::point:
        result.push_back({unit(light.vector - point), glm::length(light.vector - point), intensity});
        break;
      case LightType::headlight:
        result.push_back({unit(eye - point), glm::length(eye - point), intensity});
        break;
    }
  }
  return result;
}

glm::dvec3 Lighting::radiance(const Material& material, const glm::dvec3& color, const glm::dvec3& gradient,
                              double steepness, const glm::dvec3& toViewer,
                              std::span<const ArrivingLight> lights) const {
  glm::dvec3 all(0), seen(0);
  for (const ArrivingLight& light : lights) {
    all += light.intensity;
    seen += light.intensity * light.visibility;
  }
  glm::dvec3 unshaded(1);
  if (shadows_)
    for (int c = 0; c < 3; ++c)
      if (all[c] > 0) unshaded[c] = material.ambient + (1 - material.ambient) * seen[c] / all[c];

  const double g = shading_ ? std::min(1.0, steepness) : 0.0;
  const double s = 1 - (1 - g) * (1 - g);
  glm::dvec3 normal = unit(gradient);
  // A normal at right angles to the view, within rounding, has no side towards the viewer; it stays as it is.
  if (glm::dot(normal, toViewer) < -1e-6) normal = -normal;
  glm::dvec3 diffuse(0), specular(0);
  for (const ArrivingLight& light : lights) {
    const glm::dvec3 reaching = light.intensity * light.visibility;
    const glm::dvec3 half = unit(light.direction + toViewer);
    diffuse += reaching * std::max(glm::dot(normal, light.direction), 0.0);
    specular += reaching * std::pow(std::max(glm::dot(normal, half), 0.0), material.shininess);
  }
  return color * ((1 - s) * unshaded + s * (material.ambient + material.diffuse * diffuse)) +
         s * material.specular * specular;
}

double Lighting::brightest(const Material& m, double color) const {
  if (!any()) return color;
  glm::dvec3 all(0);
  for (const Light& light : lights_) all += light.color * light.intensity;
  const double light = shading_ ? std::max({all.x, all.y, all.z}) : 0;
  return color * std::max(1.0, m.ambient + m.diffuse * light) + m.specular * light;
}

}  // namespace scolopax::reference
