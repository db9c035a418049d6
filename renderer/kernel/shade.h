// SPDX-License-Identifier: Apache-2.0
// Lighting at a point of a ray: gradient shading and shadows.
#pragma once
#include "renderer/kernel/clip.h"
#include "renderer/kernel/gradient.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax::kernel {

/// Whether a scene has shading or shadows. The kernels of scenes that have neither contain no code for light.
struct Lit {
  static constexpr bool kAny = true;
};
struct Unlit {
  static constexpr bool kAny = false;
};

/// A normal is turned towards the viewer if the cosine of its angle to the view is below this. Where a field
/// is constant along the view, the cosine is 0 but for rounding, which must not decide about the normal.
inline constexpr float kFacesAway = -1e-6f;

/// Points on rays at which lighting is evaluated, inside the clipped volume.
template <class L>
struct LitPoint {
  RayOf<L> ray;  ///< the ray that ends here
  typename L::Float t;
  typename L::Vec point;
};

/// Direction from a point to a light, in voxel space, of length 1 in world units, and how far the light is.
template <class L>
struct ToLight {
  typename L::Vec direction;
  typename L::Float distance;
};

/// Transforms v from voxel space to world space in units of the smallest spacing.
template <class L>
SCOLOPAX_LANES typename L::Vec toWorld(const SceneView& scene, const typename L::Vec& v) {
  return product<L>(scene.worldFromVoxel, v);
}

template <class L>
SCOLOPAX_LANES ToLight<L> toLight(const SceneView& scene, const LightView& light, const LitPoint<L>& hit) {
  using Float = typename L::Float;
  using Vec = typename L::Vec;
  if (light.kind == LightKind::directional) return {Vec(light.vector), Float(kInfinity)};
  if (light.kind == LightKind::headlight) return {-hit.ray.direction, hit.t};
  const Vec way = Vec(light.vector) - hit.point, world = toWorld<L>(scene, way);
  const Float distance = squareRoot(dot(world, world)) * scene.smallestSpacing;
  return {way * (1.0f / maximum(distance, kLeastNormal)), distance};
}

/// How much of each light reaches points, and the sum of it that every channel's material needs.
template <class L>
struct Visibility {
  typename L::Float lights[kMaxLights];  ///< in [0,1]
  typename L::Vec share;                 ///< sum I V / sum I, 1 where there is no light
};

/// Visibility of the lights at points, for lanes in `which`. shadow(ray, interval) returns the ray's
/// transmittance, in [0,1], over the interval, which is its part before the light and inside the clipped
/// volume.
template <class L, class Shadow>
SCOLOPAX_LANES Visibility<L> visibilityAt(const SceneView& scene, const LitPoint<L>& hit,
                                          typename L::Mask which, Shadow&& shadow) {
  using Float = typename L::Float;
  using Vec = typename L::Vec;
  Visibility<L> visibility;
  visibility.share = Vec(1.0f);
  glm::vec3 all(0.0f);
  Vec seen(0.0f);
  for (int i = 0; i < scene.lightCount; ++i) {
    visibility.lights[i] = Float(1.0f);
    if (scene.shadows) {
      const ToLight<L> way = toLight(scene, scene.lights[i], hit);
      const RayOf<L> shadowRay{hit.point, way.direction};
      IntervalOf<L> inside = clipToScene(scene, shadowRay);
      inside.exit = where(which, minimum(inside.exit, way.distance));
      const auto meets = inside.enter < inside.exit;
      if (any(meets)) visibility.lights[i] = select(meets, shadow(shadowRay, inside), Float(1.0f));
      all += scene.lights[i].intensity;
      seen = seen + Vec(scene.lights[i].intensity) * visibility.lights[i];
    }
  }
  for (int c = 0; c < 3; ++c)
    if (all[c] > 0.0f) visibility.share[c] = seen[c] / all[c];
  return visibility;
}

/// L = c [(1-s) A + s (ka + kd sum I V max(n.l, 0))] + s ks sum I V max(n.h, 0)^p. Shading fades with the
/// magnitude g of the gradient, by s = 1 - (1-g)^2 (Kniss et al. 2002, 6.3). A dims unshaded matter in
/// shadow. For rays in `onSurface`, s = 1 where there is a gradient.
template <class L>
SCOLOPAX_LANES typename L::Vec lit(const SceneView& scene, const ChannelView& channel,
                                   const typename L::Vec& color, const LitPoint<L>& hit,
                                   const Visibility<L>& visibility, typename L::Mask which,
                                   typename L::Mask onSurface, CostOf<L>* cost) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;
  const MaterialView& material = channel.material;
  Vec ambient(1.0f);
  if (scene.shadows) ambient = Vec(material.ambient) + (1.0f - material.ambient) * visibility.share;
  const Vec unshaded = color * ambient;
  if (!scene.shading) return unshaded;

  // Scaled by its largest component: stored values may be as large or as small as floats allow, so squares of
  // the gradient may overflow or underflow.
  const Gradient<L> at = gradientAt<L>(channel.field, scene.dims, scene.gradientFromVoxel, hit.point);
  cost->fetches =
      cost->fetches + typename L::Word(onesOf(which)) * gradientFetches(channel.field, scene.dims);
  const Vec gradient = select(at.finite, at.perSpacing, Vec(0.0f));
  const Float largest = largestComponent(gradient);
  Mask shaded = which & (largest > 0.0f);
  if (!any(shaded)) return unshaded;
  const Vec scaled(gradient[0] / largest, gradient[1] / largest, gradient[2] / largest);
  const Float length = squareRoot(dot(scaled, scaled));
  const Float g = minimum(1.0f, largest * channel.inverseRange * length);
  const Float s = select(onSurface, Float(1.0f), 1.0f - (1.0f - g) * (1.0f - g));
  shaded = shaded & (s > 0.0f);
  if (!any(shaded)) return unshaded;
  const Vec toViewer = normalize(-toWorld<L>(scene, hit.ray.direction));
  Vec normal = scaled * ((channel.dataFalls ? -1.0f : 1.0f) / length);
  normal = select(dot(normal, toViewer) < kFacesAway, -normal, normal);
  Vec diffuse(0.0f), specular(0.0f);
  for (int i = 0; i < scene.lightCount; ++i) {
    const LightView& light = scene.lights[i];
    const Mask seen = visibility.lights[i] > 0.0f;
    if (!any(seen & shaded)) continue;
    const Vec l = normalize(toWorld<L>(scene, toLight(scene, light, hit).direction));
    const Vec h = normalize(l + toViewer);
    const Vec arriving = Vec(light.intensity) * visibility.lights[i];
    const Float highlight = power(maximum(dot(normal, h), 0.0f), Float(material.shininess));
    diffuse = select(seen, diffuse + arriving * maximum(dot(normal, l), 0.0f), diffuse);
    specular = select(seen, specular + arriving * highlight, specular);
  }
  const Vec light =
      color * ((1.0f - s) * ambient + s * (Vec(material.ambient) + material.diffuse * diffuse)) +
      s * material.specular * specular;
  return select(shaded, light, unshaded);
}

}  // namespace scolopax::kernel
