// SPDX-License-Identifier: Apache-2.0
// Light at a collision: gradient shading and shadows (renderer section 4.6). Both are parameters of the
// kernel: what a scene does not use is not compiled into the one that runs.
#pragma once
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax::kernel {

/// What a scene asks for; an instance per combination.
template <bool kShadingOn, bool kShadowsOn>
struct LightFeatures {
  static constexpr bool kShading = kShadingOn, kShadows = kShadowsOn;
  static constexpr bool kAny = kShading || kShadows;
};

/// Direction from a point to a light, in voxel space, of length 1 in world units, and how far the light is.
struct ToLight {
  glm::vec3 direction;
  float distance;
};

/// v times the matrix that takes voxel space to the world in units of the smallest spacing.
SCOLOPAX_HD inline glm::vec3 toWorld(const SceneView& scene, glm::vec3 v) { return scene.worldFromVoxel * v; }

SCOLOPAX_HD inline float dot(glm::vec3 a, glm::vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SCOLOPAX_HD inline glm::vec3 normalize(glm::vec3 v) {
  const float lengthSquared = dot(v, v);
  return lengthSquared > 0.0f ? v * (1.0f / squareRoot(lengthSquared)) : v;
}

SCOLOPAX_HD inline float largestComponent(glm::vec3 v) {
  return maximum(maximum(maximum(v.x, -v.x), maximum(v.y, -v.y)), maximum(v.z, -v.z));
}

SCOLOPAX_HD inline ToLight toLight(const SceneView& scene, const LightView& light, const Ray& ray,
                                   const Collision& hit) {
  if (light.kind == LightKind::directional) return {light.vector, kInfinity};
  if (light.kind == LightKind::headlight) return {-ray.direction, hit.place.t()};
  const glm::vec3 way = light.vector - hit.point;
  const float distance = squareRoot(dot(toWorld(scene, way), toWorld(scene, way))) * scene.smallestSpacing;
  return {way * (1.0f / maximum(distance, kLeastNormal)), distance};
}

/// Gradient of one channel's stored values in world space, per smallest spacing: central differences of one
/// voxel, one-sided at the border; zero where a value is not finite.
SCOLOPAX_HD inline glm::vec3 gradientAt(const SceneView& scene, const ChannelView& channel, glm::vec3 point,
                                        SampleCost* cost) {
  glm::vec3 perVoxel(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const float at = clamp(point[axis], 0.0f, float(scene.dims[axis] - 1));
    glm::vec3 low = point, high = point;
    low[axis] = maximum(at - 1.0f, 0.0f);
    high[axis] = minimum(at + 1.0f, float(scene.dims[axis] - 1));
    if (!(low[axis] < high[axis])) continue;
    cost->fetches += 2;
    const float difference = sampleStored(channel, scene.dims, high) - sampleStored(channel, scene.dims, low);
    perVoxel[axis] = difference / (high[axis] - low[axis]);
  }
  if (!isFinite(perVoxel.x) || !isFinite(perVoxel.y) || !isFinite(perVoxel.z)) return glm::vec3(0.0f);
  return scene.gradientFromVoxel * perVoxel;
}

/// Which lights reach a collision, as the sums that every channel's material needs.
struct Visibility {
  float lights[kMaxLights];  ///< in [0,1]
  glm::vec3 share;           ///< sum I V / sum I, 1 where there is no light
};

/// shadow(ray, part of it inside the box) estimates the ray's transmittance, in [0,1].
template <class Features, class Shadow>
SCOLOPAX_HD Visibility visibilityAt(const SceneView& scene, const Ray& ray, const Collision& hit,
                                    Shadow&& shadow) {
  Visibility visibility;
  glm::vec3 all(0.0f), seen(0.0f);
  for (int i = 0; i < scene.lightCount; ++i) {
    visibility.lights[i] = 1.0f;
    if constexpr (Features::kShadows) {
      const ToLight way = toLight(scene, scene.lights[i], ray, hit);
      const Ray shadowRay{hit.point, way.direction};
      Interval inside = clipToBox(shadowRay, scene.dims);
      inside.exit = minimum(inside.exit, way.distance);
      if (inside.enter < inside.exit) visibility.lights[i] = shadow(shadowRay, inside);
      all += scene.lights[i].intensity;
      seen += scene.lights[i].intensity * visibility.lights[i];
    }
  }
  for (int c = 0; c < 3; ++c) visibility.share[c] = all[c] > 0.0f ? seen[c] / all[c] : 1.0f;
  return visibility;
}

/// L = c [(1-s) A + s (ka + kd sum I V max(n.l, 0))] + s ks sum I V max(n.h, 0)^p, faded by the gradient's
/// magnitude g with s = 1 - (1-g)^2 (Kniss et al. 2002, 6.3); A dims unshaded matter in shadow.
template <class Features>
SCOLOPAX_HD glm::vec3 lit(const SceneView& scene, const ChannelView& channel, glm::vec3 color, const Ray& ray,
                          const Collision& hit, const Visibility& visibility, SampleCost* cost) {
  const MaterialView& material = channel.material;
  glm::vec3 ambient(1.0f);
  if constexpr (Features::kShadows) ambient = material.ambient + (1.0f - material.ambient) * visibility.share;
  if constexpr (!Features::kShading) return color * ambient;

  // In units of its largest component: stored values may be as large or small as floats can, and their
  // squares are not.
  const glm::vec3 gradient = gradientAt(scene, channel, hit.point, cost);
  const float largest = largestComponent(gradient);
  if (!(largest > 0.0f)) return color * ambient;
  const glm::vec3 scaled(gradient.x / largest, gradient.y / largest, gradient.z / largest);
  const float length = squareRoot(dot(scaled, scaled));
  const float g = minimum(1.0f, largest * channel.inverseRange * length);
  const float s = 1.0f - (1.0f - g) * (1.0f - g);
  if (!(s > 0.0f)) return color * ambient;
  const glm::vec3 toViewer = normalize(-toWorld(scene, ray.direction));
  glm::vec3 normal = scaled * (1.0f / length);
  if (dot(normal, toViewer) < 0.0f) normal = -normal;
  glm::vec3 diffuse(0.0f), specular(0.0f);
  for (int i = 0; i < scene.lightCount; ++i) {
    const LightView& light = scene.lights[i];
    const float seen = visibility.lights[i];
    if (!(seen > 0.0f)) continue;
    const glm::vec3 l = normalize(toWorld(scene, toLight(scene, light, ray, hit).direction));
    const glm::vec3 h = normalize(l + toViewer);
    diffuse += light.intensity * seen * maximum(dot(normal, l), 0.0f);
    const float highlight = maximum(dot(normal, h), 0.0f);
    specular += light.intensity * seen * power(highlight, material.shininess);
  }
  return color * ((1.0f - s) * ambient + s * (material.ambient + material.diffuse * diffuse)) +
         s * material.specular * specular;
}

}  // namespace scolopax::kernel
