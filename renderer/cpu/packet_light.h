// SPDX-License-Identifier: Apache-2.0
// kernel/shade.h for as many strata of rays at once as there are lanes.
#pragma once
#include "renderer/cpu/packet_march.h"
#include "renderer/cpu/packet_sampler.h"
#include "renderer/kernel/strata.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

struct Vec {
  Float x[3];
  SCOLOPAX_SIMD Float& operator[](int i) { return x[i]; }
  SCOLOPAX_SIMD const Float& operator[](int i) const { return x[i]; }
};
SCOLOPAX_SIMD Vec vectors(glm::vec3 v) { return {{floats(v.x), floats(v.y), floats(v.z)}}; }
SCOLOPAX_SIMD Vec operator+(const Vec& a, const Vec& b) { return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}}; }
SCOLOPAX_SIMD Vec operator*(const Vec& a, const Vec& b) { return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}}; }
SCOLOPAX_SIMD Vec operator*(const Vec& a, Float b) { return {{a[0] * b, a[1] * b, a[2] * b}}; }
SCOLOPAX_SIMD Vec negative(const Vec& a) { return {{negative(a[0]), negative(a[1]), negative(a[2])}}; }
SCOLOPAX_SIMD Vec select(Mask m, const Vec& a, const Vec& b) {
  return {{select(m, a[0], b[0]), select(m, a[1], b[1]), select(m, a[2], b[2])}};
}
SCOLOPAX_SIMD Float dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
SCOLOPAX_SIMD Vec normalize(const Vec& v) {
  const Float lengthSquared = dot(v, v);
  return select(lengthSquared > floats(0.0f), v * (floats(1.0f) / squareRoot(lengthSquared)), v);
}
SCOLOPAX_SIMD Vec product(const glm::mat3& m, const Vec& v) {
  Vec result;
  for (int i = 0; i < 3; ++i)
    result[i] = floats(m[0][i]) * v[0] + floats(m[1][i]) * v[1] + floats(m[2][i]) * v[2];
  return result;
}

/// Strata that are to be lit, at most one a lane, and whose they are.
struct LightQueue {
  int count = 0;
  std::int32_t lane[kLanes];
  float mass[kLanes];               ///< of the ray's light
  float t[kLanes], offset[kLanes];  ///< the place, and the jitter of its shadow rays
  glm::vec3 radiance[kLanes];       ///< there, without lights
  glm::vec3 emission[kLanes];       ///< of all of the stratum, without lights
  std::int32_t channels[kLanes];    ///< bit n: channel n is there
  struct Channel {
    float share[kLanes], color[3][kLanes];
  } channel[kernel::kMaxVisibleChannels];
};

/// kernel::lit of what waits. The colours are added to the rays' in the order in which they came.
template <class Features>
class PacketLight {
 public:
  /// Channels by their bits: those that shadow rays see too.
  SCOLOPAX_SIMD PacketLight(const kernel::SceneView& scene, const Rays& rays, std::uint32_t channels,
                            PacketCost* cost)
      : scene_(scene), rays_(rays), channels_(channels), cost_(cost) {}

  SCOLOPAX_SIMD_ONLY __attribute__((noinline)) void shine(LightQueue& queue, glm::vec3* colors) {
    const Int lane = load(queue.lane);
    waiting_ = ints(queue.count) > laneNumbers();
    for (int axis = 0; axis < 3; ++axis) {
      ray_.origin[axis] = permuted(rays_.origin[axis], lane);
      ray_.direction[axis] = permuted(rays_.direction[axis], lane);
    }
    spent_ = noCost();
    place_ = load(queue.t);
    point_ = pointAt(place_);
    findVisibility(load(queue.offset));
    Vec sum = vectors(glm::vec3(0.0f));
    const Int present = load(queue.channels);
    for (int n = 0; n < scene_.channelCount; ++n) {
      const Int bit = ints(int(1u << n));
      const Mask lit = waiting_ & ((present & bit) == bit);
      if (!any(lit)) continue;
      const LightQueue::Channel& channel = queue.channel[n];
      const Vec color{{load(channel.color[0]), load(channel.color[1]), load(channel.color[2])}};
      const Vec light = lightOf(scene_.channels[n], color, lit) * load(channel.share);
      for (int c = 0; c < 3; ++c) sum[c] = select(lit, sum[c] + light[c], sum[c]);
    }
    for (int i = 0; i < queue.count; ++i) {
      const int to = queue.lane[i];
      const glm::vec3 light(at(sum[0], i), at(sum[1], i), at(sum[2], i));
      sums_[to].add({light, queue.radiance[i], queue.emission[i], queue.mass[i]}, colors[to]);
      addLane(spent_.fetches, i, to, &cost_->fetches);
      addLane(spent_.cellSteps, i, to, &cost_->cellSteps);
      addLane(spent_.truncated, i, to, &cost_->truncated);
    }
    queue.count = 0;
  }

  /// Of all that has been lit.
  void finish(glm::vec3* colors) const {
    for (int i = 0; i < kLanes; ++i) sums_[i].finish(colors[i]);
  }

 private:
  SCOLOPAX_SIMD static void addLane(Int from, int i, int to, Int* sum) {
    *sum = *sum + select(laneNumbers() == ints(to), ints(at(from, i)), ints(0));
  }

  /// kernel::collisionAt.
  SCOLOPAX_SIMD Vec pointAt(Float t) const {
    Vec point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = clamp(ray_.origin[axis] + t * ray_.direction[axis], floats(-0.5f),
                          floats(float(scene_.dims[axis]) - 0.5f));
    return point;
  }

  /// kernel::toLight.
  struct Way {
    Vec direction;
    Float distance;
  };
  SCOLOPAX_SIMD Way wayTo(const kernel::LightView& light) const {
    if (light.kind == kernel::LightKind::directional)
      return {vectors(light.vector), floats(kernel::kInfinity)};
    if (light.kind == kernel::LightKind::headlight)
      return {negative(Vec{{ray_.direction[0], ray_.direction[1], ray_.direction[2]}}), place_};
    Vec way;
    for (int axis = 0; axis < 3; ++axis) way[axis] = floats(light.vector[axis]) - point_[axis];
    const Vec world = product(scene_.worldFromVoxel, way);
    const Float distance = squareRoot(dot(world, world)) * floats(scene_.smallestSpacing);
    return {way * (floats(1.0f) / maximum(distance, floats(kernel::kLeastNormal))), distance};
  }

  /// Optical depth of shadow rays (kernel::marchTransmittance).
  class Depth {
   public:
    SCOLOPAX_SIMD explicit Depth(const kernel::SceneView& scene) : scene_(scene), depth_(floats(0.0f)) {}
    SCOLOPAX_SIMD Mask take(const PacketSegment& segment) {
      Float extinction = floats(0.0f);
      for (std::uint32_t left = segment.channels; left != 0; left &= left - 1) {
        const int n = std::countr_zero(left);
        extinction = extinction + partsOf<Detail::extinction>(scene_.channels[n], segment.from[n],
                                                              segment.to[n], segment.of(scene_, n))
                                      .opacity;
      }
      depth_ = depth_ + extinction * (segment.end - segment.start);
      return depth_ < floats(kernel::kOpaqueDepth);
    }
    SCOLOPAX_SIMD Float transmittance() const { return floats(1.0f) - absorbed(depth_); }

   private:
    const kernel::SceneView& scene_;
    Float depth_;
  };

  /// kernel::visibilityAt.
  SCOLOPAX_SIMD void findVisibility(Float offset) {
    const Float one = floats(1.0f);
    share_ = vectors(glm::vec3(1.0f));
    for (int i = 0; i < scene_.lightCount; ++i) seen_[i] = one;
    if constexpr (Features::kShadows) {
      glm::vec3 all(0.0f);
      Vec sum = vectors(all);
      for (int i = 0; i < scene_.lightCount; ++i) {
        const Way way = wayTo(scene_.lights[i]);
        const Rays shadow{{point_[0], point_[1], point_[2]},
                          {way.direction[0], way.direction[1], way.direction[2]}};
        Intervals inside = clipToBox(shadow, scene_.dims);
        inside.exit = minimum(inside.exit, way.distance);
        inside.meets = inside.meets & waiting_ & (inside.enter < inside.exit);
        Depth depth(scene_);
        if (any(inside.meets))
          PacketMarch(scene_, shadow, inside, channels_, offset, kernel::kShadowSteps * scene_.step, &spent_)
              .follow(depth);
        seen_[i] = select(inside.meets, depth.transmittance(), one);
        all += scene_.lights[i].intensity;
        sum = sum + vectors(scene_.lights[i].intensity) * seen_[i];
      }
      for (int c = 0; c < 3; ++c)
        if (all[c] > 0.0f) share_[c] = sum[c] / floats(all[c]);
    }
  }

  SCOLOPAX_SIMD static Float sizeOf(Float x) { return maximum(x, negative(x)); }

  /// kernel::gradientAt.
  SCOLOPAX_SIMD Vec gradientAt(const kernel::ChannelView& channel, const Vec& point, Mask which) {
    const glm::ivec3 dims = scene_.dims;
    Vec perVoxel = vectors(glm::vec3(0.0f));
    for (int axis = 0; axis < 3; ++axis) {
      if (dims[axis] < 2) continue;
      const Float last = floats(float(dims[axis] - 1)), one = floats(1.0f), zero = floats(0.0f);
      const Float at = clamp(point[axis], zero, last);
      const Float low = maximum(at - one, zero), high = minimum(at + one, last);
      const Float difference =
          sampleBeside(channel, point, axis, high) - sampleBeside(channel, point, axis, low);
      perVoxel[axis] = difference / (high - low);
      spent_.fetches = spent_.fetches + onesOf(which) + onesOf(which);
    }
    const Mask finite = isFinite(perVoxel[0]) & isFinite(perVoxel[1]) & isFinite(perVoxel[2]);
    return select(finite, product(scene_.gradientFromVoxel, perVoxel), vectors(glm::vec3(0.0f)));
  }
  /// At the point that has another place on one axis.
  SCOLOPAX_SIMD Float sampleBeside(const kernel::ChannelView& channel, const Vec& point, int axis,
                                   Float place) const {
    const glm::ivec3 dims = scene_.dims;
    Vec beside = point;
    beside[axis] = place;
    return sampleChannel(pointsAt(dims, beside[0], beside[1], beside[2]), channel);
  }

  /// kernel::lit.
  SCOLOPAX_SIMD Vec lightOf(const kernel::ChannelView& channel, const Vec& color, Mask which) {
    const kernel::MaterialView& material = channel.material;
    const Float one = floats(1.0f), zero = floats(0.0f);
    Vec ambient = vectors(glm::vec3(1.0f));
    if constexpr (Features::kShadows)
      for (int c = 0; c < 3; ++c)
        ambient[c] = floats(material.ambient) + floats(1.0f - material.ambient) * share_[c];
    const Vec unshaded = color * ambient;
    if constexpr (!Features::kShading) return unshaded;

    const Vec gradient = gradientAt(channel, point_, which);
    const Float largest = maximum(maximum(sizeOf(gradient[0]), sizeOf(gradient[1])), sizeOf(gradient[2]));
    Mask shaded = which & (largest > zero);
    if (!any(shaded)) return unshaded;
    Vec normal;
    for (int i = 0; i < 3; ++i) normal[i] = gradient[i] / largest;
    const Float length = squareRoot(dot(normal, normal));
    const Float g = minimum(one, largest * floats(channel.inverseRange) * length);
    const Float s = one - (one - g) * (one - g);
    shaded = shaded & (s > zero);
    if (!any(shaded)) return unshaded;
    const Vec direction{{ray_.direction[0], ray_.direction[1], ray_.direction[2]}};
    const Vec toViewer = normalize(negative(product(scene_.worldFromVoxel, direction)));
    normal = normal * (one / length);
    normal = select(dot(normal, toViewer) < zero, negative(normal), normal);
    Vec diffuse = vectors(glm::vec3(0.0f)), specular = diffuse;
    for (int i = 0; i < scene_.lightCount; ++i) {
      const kernel::LightView& light = scene_.lights[i];
      const Mask reached = seen_[i] > zero;
      if (!any(reached & shaded)) continue;
      const Vec l = normalize(product(scene_.worldFromVoxel, wayTo(light).direction));
      const Vec h = normalize(l + toViewer);
      const Vec arriving = vectors(light.intensity) * seen_[i];
      const Float lambert = maximum(dot(normal, l), zero);
      const Float highlight = power(maximum(dot(normal, h), zero), floats(material.shininess));
      diffuse = select(reached, diffuse + arriving * lambert, diffuse);
      specular = select(reached, specular + arriving * highlight, specular);
    }
    Vec light;
    for (int c = 0; c < 3; ++c)
      light[c] = color[c] * ((one - s) * ambient[c] +
                             s * (floats(material.ambient) + floats(material.diffuse) * diffuse[c])) +
                 s * floats(material.specular) * specular[c];
    return select(shaded, light, unshaded);
  }

  const kernel::SceneView& scene_;
  const Rays& rays_;
  std::uint32_t channels_;
  PacketCost* cost_;
  kernel::StrataSum sums_[kLanes];  // of the rays
  Rays ray_;                        // of the strata
  Float place_;
  Vec point_;
  Mask waiting_;
  PacketCost spent_;
  Float seen_[kernel::kMaxLights];
  Vec share_;
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
