// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/random_scenes/direct_march.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <vector>

#include "tests/renderer/random_scenes/march_steps.h"
#include "tests/renderer/random_scenes/matter.h"

namespace scolopax::random_scenes {
namespace {

using glm::dvec3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double dot(const dvec3& a, const dvec3& b) { return glm::dot(a, b); }
dvec3 unit(const dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : dvec3(0);
}

class Marcher {
 public:
  Marcher(const VolumeSource& source, const Scene& scene) : scene_(scene), grid_(source.grid) {
    const glm::dmat3 linear(grid_.worldFromVoxel);
    voxelFromWorld_ = glm::inverse(linear);
    smallest_ = kInfinity;
    for (int axis = 0; axis < 3; ++axis) smallest_ = std::min(smallest_, glm::length(linear[axis]));
    for (std::size_t n = 0; n < source.channels.size(); ++n) {
      const ChannelSource& channel = source.channels[n];
      if (!scene.channels[n].visible) continue;
      Matter matter{int(n), {}, grid_.dims, &scene.channels[n]};
      visitScalarType(channel.voxels.type(), [&](auto zero) {
        for (const auto voxel : channel.voxels.template as<decltype(zero)>())
          matter.values.push_back(channel.slope * double(voxel) + channel.intercept);
      });
      matter.findSurfaces(smallest_);
      if (matter.look->interpolation == Interpolation::nearest) cutsPerVoxel_ = 2;
      matters_.push_back(std::move(matter));
    }
    lights_ = scene.lights;
    if (lights_.empty()) lights_.emplace_back();  // a headlight
    dvec3 light(0);
    for (const Light& l : lights_) light += l.intensity * l.color;
    for (const Matter& m : matters_) {
      density_ += m.look->density;
      dvec3 color(0);
      for (const ColorKnot& knot : m.look->color) color = glm::max(color, knot.color);
      for (const Matter::Surface& surface : m.surfaces) color = glm::max(color, surface.color);
      dvec3 shown = color;
      const Material& k = m.look->material;
      if (scene.shadows) shown = color * std::fmax(1, k.ambient);
      if (scene.shading)
        shown = glm::max(shown, color * (k.ambient + k.diffuse * light)) + k.specular * light;
      if (scene.blend == BlendMode::mix) shown *= std::fmax(1, m.look->weight);
      for (int c = 0; c < 3; ++c) radiance_ = std::fmax(radiance_, shown[c]);
    }
    radiance_ = std::fmax(radiance_, 1);
  }

  /// Marches the ray through the centre of a pixel.
  Marched pixel(int column, int row) const {
    const Camera& camera = scene_.camera;
    const dvec3 forward = unit(camera.target - camera.eye);
    dvec3 right = glm::cross(forward, unit(camera.up));
    if (!(glm::length(right) > 1e-6))  // up along the view
      right = unit(glm::cross(forward, std::abs(forward.z) < 0.9 ? dvec3(0, 0, 1) : dvec3(0, 1, 0)));
    right = unit(right);
    const dvec3 up = glm::cross(right, forward);
    const double height =
        camera.orthoHeight ? *camera.orthoHeight : 2 * std::tan(camera.fovY * 3.14159265358979323846 / 360);
    const dvec3 offset =
        height / scene_.height *
        ((column + 0.5 - 0.5 * scene_.width) * right + (0.5 * scene_.height - row - 0.5) * up);
    const dvec3 origin = camera.orthoHeight ? camera.eye + offset : camera.eye;
    const dvec3 direction = camera.orthoHeight ? forward : unit(forward + offset);
    Marched all;
    if (scene_.blend != BlendMode::composite) return ray(origin, direction, matters_);
    for (const Matter& matter : matters_) {
      const Marched alone = ray(origin, direction, {matter});
      all.rgba = glm::dvec4(dvec3(all.rgba) + dvec3(alone.rgba), 1 - (1 - all.rgba.a) * (1 - alone.rgba.a));
      all.error += alone.error;
      all.runs.insert(all.runs.end(), alone.runs.begin(), alone.runs.end());
    }
    return all;
  }

 private:
  using Matters = std::vector<Matter>;
  dvec3 toVoxel(const dvec3& world) const {
    return voxelFromWorld_ * (world - dvec3(grid_.worldFromVoxel[3]));
  }

  /// The part of 0 <= t <= `length` in which a ray in voxel space is inside the box; false if there is none.
  bool clip(const dvec3& origin, const dvec3& direction, double length, double* begin, double* end) const {
    *begin = 0;
    *end = length;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (-0.5 - origin[axis]) / direction[axis];
      const double b = (grid_.dims[axis] - 0.5 - origin[axis]) / direction[axis];
      if (direction[axis] == 0) {
        if (origin[axis] < -0.5 || origin[axis] > grid_.dims[axis] - 0.5) return false;
        continue;
      }
      *begin = std::fmax(*begin, std::fmin(a, b));
      *end = std::fmin(*end, std::fmax(a, b));
    }
    return *begin < *end && std::isfinite(*end);
  }

  /// Whether the clip planes and crop keep a channel at a point in voxel coordinates.
  bool isLeft(int channel, const dvec3& p) const {
    const dvec3 world(grid_.worldFromVoxel * glm::dvec4(p, 1));
    for (const ClipPlane& plane : scene_.clip) {
      const auto& some = plane.channels;
      if (some && std::find(some->begin(), some->end(), channel) == some->end()) continue;
      if (dot(plane.normal, world - plane.point) < 0) return false;
    }
    if (!scene_.crop) return true;
    const auto slab = [&](int axis) {
      const double far = grid_.dims[axis] - 0.5;
      const auto isBelow = [&](double at) { return at >= far || (at > -0.5 && p[axis] < at); };
      return isBelow(scene_.crop->low[axis]) ? 0 : isBelow(scene_.crop->high[axis]) ? 1 : 2;
    };
    return (scene_.crop->regions >> (slab(0) + 3 * slab(1) + 9 * slab(2))) & 1;
  }

  /// One channel at a point, and its share of the radiance.
  struct Classified {
    double value = 0, extinction = 0, share = 0;
    bool isThere = false;
    dvec3 color{0};
  };
  /// All channels at a point, and the blended extinction.
  struct Mixture {
    std::vector<Classified> parts;
    double extinction = 0;
  };
  Mixture mixtureAt(const dvec3& p, const Matters& matters, Decisions* decisions) const {
    Mixture mixture;
    mixture.parts.reserve(matters.size());
    std::size_t largest = 0;
    double sum = 0;
    for (const Matter& m : matters) {
      Classified c;
      c.value = m.at(p, decisions);
      c.isThere = std::isfinite(c.value) && isLeft(m.number, p);
      decisions->note(c.isThere);
      if (c.isThere) {
        const double position = m.position(c.value);
        decisions->note(std::uint64_t((position > 0) + (position >= 1)));
        if (m.look->peaks != Peaks::only)
          c.extinction = m.look->density * Matter::curve(m.look->opacity, position, decisions,
                                                         [](const OpacityKnot& k) { return k.value; });
        if (c.extinction > 0) c.extinction *= m.factor(p, glm::transpose(voxelFromWorld_), decisions);
        c.color =
            Matter::curve(m.look->color, position, decisions, [](const ColorKnot& k) { return k.color; });
      }
      sum += c.extinction;
      mixture.parts.push_back(c);
      if (c.extinction > mixture.parts[largest].extinction) largest = mixture.parts.size() - 1;
    }
    if (matters.empty()) return mixture;
    const bool one = scene_.blend == BlendMode::max, several = scene_.blend == BlendMode::mix;
    mixture.extinction = one || several ? mixture.parts[largest].extinction : sum;
    if (one || several) decisions->note(largest);
    if (!(mixture.extinction > 0)) return mixture;
    for (std::size_t n = 0; n < matters.size(); ++n) {
      if (one && n != largest) continue;
      Classified& part = mixture.parts[n];
      part.share = part.extinction / mixture.extinction * (several ? matters[n].look->weight : 1);
    }
    return mixture;
  }

  /// The side of every surface on which a point is.
  static std::vector<Side> sidesOf(const Mixture& mixture, const Matters& matters, Decisions* decisions) {
    std::vector<Side> sides;
    for (std::size_t n = 0; n < matters.size(); ++n) {
      const Classified& part = mixture.parts[n];
      for (const Matter::Surface& surface : matters[n].surfaces)
        sides.push_back(!part.isThere                 ? Side::neither
                        : part.value >= surface.value ? Side::above
                                                      : Side::below);
    }
    for (const Side side : sides) decisions->note(std::uint64_t(side));
    return sides;
  }
  /// Surface number k of these channels.
  static std::pair<const Matter*, const Matter::Surface*> surface(const Matters& matters, std::size_t k) {
    for (const Matter& m : matters) {
      if (k < m.surfaces.size()) return {&m, &m.surfaces[k]};
      k -= m.surfaces.size();
    }
    return {};
  }

  /// Transmittance along a ray in voxel space. A surface at which it begins does not count.
  double transmittance(const dvec3& p, bool onSurface, const dvec3& direction, double length,
                       const Matters& matters, double* error) const {
    double begin, end;
    if (!clip(p, direction, length, &begin, &end)) return 1;
    if (onSurface) begin += 1e-5 * stepOf(direction, 1);
    const auto surfaceAt = [&](std::size_t k, double) {
      return Stretch{1 - surface(matters, k).second->opacity, dvec3(0)};
    };
    const auto sampleAt = [&](double t) {
      Decisions decisions;
      const Mixture mixture = mixtureAt(p + t * direction, matters, &decisions);
      std::vector<Side> sides = sidesOf(mixture, matters, &decisions);
      return PointSample{mixture.extinction, dvec3(0), decisions.hash(), std::move(sides)};
    };
    SteppedMarch march(sampleAt, sampleAt, surfaceAt,
                       {stepOf(direction, 12), 1e-7, density_, 1, kMostShadowSamples});
    marchCells(p, direction, begin, end, march);
    *error = std::fmax(*error, march.error());
    return march.result().transmittance;
  }

  struct Arriving {
    dvec3 direction, intensity;  // towards the light
    double visible = 1;
  };
  std::vector<Arriving> lightsAt(const dvec3& p, bool onSurface, const dvec3& eye, const Matters& matters,
                                 bool look, double* error) const {
    std::vector<Arriving> arriving;
    const dvec3 world(grid_.worldFromVoxel * glm::dvec4(p, 1));
    for (const Light& light : lights_) {
      Arriving a{unit(-light.vector), light.intensity * light.color};
      double distance = kInfinity;
      if (light.type != LightType::directional) {
        const dvec3 way = (light.type == LightType::point ? light.vector : eye) - world;
        distance = glm::length(way);
        a.direction = unit(way);
      }
      if (scene_.shadows && look && distance > 0 && a.intensity != dvec3(0))
        a.visible = transmittance(p, onSurface, voxelFromWorld_ * a.direction, distance, matters, error);
      arriving.push_back(a);
    }
    return arriving;
  }

  dvec3 shown(const Matter& m, const dvec3& color, bool onSurface, const dvec3& p, const dvec3& viewer,
              const std::vector<Arriving>& lights, Decisions* decisions) const {
    const Material& k = m.look->material;
    dvec3 all(0), seen(0), a(1);
    for (const Arriving& l : lights) {
      all += l.intensity;
      seen += l.visible * l.intensity;
    }
    if (scene_.shadows)
      for (int i = 0; i < 3; ++i)
        if (all[i] > 0) a[i] = k.ambient + (1 - k.ambient) * seen[i] / all[i];
    if (!scene_.shading) return color * a;
    const dvec3 gradient = glm::transpose(voxelFromWorld_) * m.gradient(p).value_or(dvec3(0));
    const double steepness = glm::length(gradient) * smallest_;
    decisions->note(steepness > 0);
    if (!(steepness > 0)) return color * a;
    const double g = onSurface ? 1 : std::fmin(1, steepness / std::abs(m.look->rangeHi - m.look->rangeLo));
    const double s = 1 - (1 - g) * (1 - g);
    decisions->note(g < 1);
    dvec3 n = unit(gradient);
    const bool away = dot(n, viewer) < -1e-6;
    decisions->note(away);
    if (away) n = -n;
    dvec3 diffuse(0), specular(0);
    for (const Arriving& l : lights) {
      const double nl = dot(n, l.direction), nh = dot(n, unit(l.direction + viewer));
      decisions->note(nl > 0);
      decisions->note(nh > 0);
      diffuse += l.visible * l.intensity * std::fmax(nl, 0);
      specular += l.visible * l.intensity * std::pow(std::fmax(nh, 0), k.shininess);
    }
    return color * ((1 - s) * a + s * (k.ambient + k.diffuse * diffuse)) + s * k.specular * specular;
  }

  /// Length of a step of 1/n of a voxel.
  static double stepOf(const dvec3& way, int n) {
    return 1 / (n * (std::abs(way.x) + std::abs(way.y) + std::abs(way.z)));
  }
  /// Marches between the planes of voxel centres, where the field has kinks, and between the faces of voxels
  /// if it may jump there.
  template <class March>
  void marchCells(const dvec3& origin, const dvec3& way, double begin, double end, March& march) const {
    std::vector<double> cuts{begin, end};
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < cutsPerVoxel_ * grid_.dims[axis] && way[axis] != 0; ++k) {
        const double t = (double(k) / cutsPerVoxel_ - origin[axis]) / way[axis];
        if (t > begin && t < end) cuts.push_back(t);
      }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) march.march(cuts[i], cuts[i + 1]);
  }

  Marched ray(const dvec3& eye, const dvec3& direction, const Matters& matters) const {
    const dvec3 origin = toVoxel(eye), way = voxelFromWorld_ * direction;
    const bool lit = scene_.shading || scene_.shadows;
    double begin, end, shadowError = 0;
    if (!clip(origin, way, kInfinity, &begin, &end)) return {};
    const auto sample = [&](double t, bool look) {
      Decisions decisions;
      const dvec3 p = origin + t * way;
      const Mixture mixture = mixtureAt(p, matters, &decisions);
      PointSample result{mixture.extinction, dvec3(0), 0};
      if (mixture.extinction > 0) {
        std::vector<Arriving> lights;
        if (lit) lights = lightsAt(p, false, eye, matters, look, &shadowError);
        for (std::size_t n = 0; n < matters.size(); ++n)
          if (const Classified& part = mixture.parts[n]; part.share > 0)
            result.radiance +=
                part.share *
                (lit ? shown(matters[n], part.color, false, p, -direction, lights, &decisions) : part.color);
      }
      result.sides = sidesOf(mixture, matters, &decisions);
      result.decisions = decisions.hash();
      return result;
    };
    const auto sampleAt = [&](double t) { return sample(t, true); };
    const auto glanceAt = [&](double t) { return sample(t, false); };
    const int perVoxel = scene_.shadows ? 16 : lit ? 64 : 300;
    const StepRules rules{stepOf(way, perVoxel), lit ? 1e-6 : 1e-9, density_, radiance_,
                          scene_.shadows ? kMostLitSamples : kMostSamples};
    const auto surfaceAt = [&](std::size_t k, double t) {
      const auto [matter, met] = surface(matters, k);
      const dvec3 p = origin + t * way;
      Decisions decisions;
      dvec3 color = met->color;
      if (lit)
        color = shown(*matter, color, true, p, -direction,
                      lightsAt(p, true, eye, matters, true, &shadowError), &decisions);
      return Stretch{1 - met->opacity, met->opacity * color};
    };
    SteppedMarch march(sampleAt, glanceAt, surfaceAt, rules);
    marchCells(origin, way, begin, end, march);
    const Stretch& result = march.result();
    return {glm::dvec4(result.light, 1 - result.transmittance),
            (march.error() + double(lights_.size()) * shadowError) * radiance_, march.runs()};
  }

  static constexpr int kMostShadowSamples = 2000, kMostLitSamples = 2000, kMostSamples = 200000;

  const Scene& scene_;
  Grid grid_;
  glm::dmat3 voxelFromWorld_;
  double smallest_;
  Matters matters_;
  std::vector<Light> lights_;
  double density_ = 0, radiance_ = 0;
  int cutsPerVoxel_ = 1;
};

}  // namespace

double Marched::depthOfRunsBelow(double step) const {
  double depth = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].length >= 2 * step) continue;
    double rate = runs[i].largestExtinction;
    if (i > 0) rate = std::max(rate, runs[i - 1].largestExtinction);
    if (i + 1 < runs.size()) rate = std::max(rate, runs[i + 1].largestExtinction);
    depth += rate * runs[i].length;
  }
  return depth;
}

Marched directMarch(const VolumeSource& source, const Scene& scene, int column, int row) {
  return Marcher(source, scene).pixel(column, row);
}

}  // namespace scolopax::random_scenes
