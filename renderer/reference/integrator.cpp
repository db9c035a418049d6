// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "renderer/core/error.h"
#include "renderer/reference/gauss_rule.h"

namespace scolopax::reference {
namespace {

constexpr double kMaxPieceDepth = 4;  // a piece of the ray thicker than this is bisected unseen

/// What blending makes of the channels at a point.
struct Blended {
  double extinction = 0;                     // per world unit
  std::array<double, kMaxChannels> share{};  // of each channel's radiance in extinction x radiance
};

/// The blend modes: one case each.
Blended blended(BlendMode mode, const Stretch& stretch, const ChannelSample* samples) {
  Blended result;
  const std::size_t count = stretch.channels.size();
  // Of equal channels the first, also where only rounding tells them apart: channels of one field over
  // different ranges would otherwise take turns at every point, and no bisection would end.
  std::size_t largest = 0;
  for (std::size_t n = 1; n < count; ++n)
    if (samples[n].extinction * (1 - kEqualExtinction) > samples[largest].extinction) largest = n;
  switch (mode) {
    case BlendMode::density:
    case BlendMode::composite:  // of a single channel, see Integrator::trace
      for (std::size_t n = 0; n < count; ++n) {
        result.extinction += samples[n].extinction;
        result.share[n] = samples[n].extinction;
      }
      break;
    case BlendMode::max:
      if (count > 0) result.extinction = result.share[largest] = samples[largest].extinction;
      break;
    case BlendMode::mix:
      if (count > 0) result.extinction = samples[largest].extinction;
      for (std::size_t n = 0; n < count; ++n)
        result.share[n] = stretch.channels[n].channel->weight * samples[n].extinction;
      break;
  }
  return result;
}

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

/// What a point of the ray does to the light on its way.
struct Integrator::Medium {
  double extinction = 0;   // per world unit
  glm::dvec3 emission{0};  // extinction times radiance
};

/// Light that a piece of the ray adds as seen from its beginning, and how thick it is.
struct Integrator::PieceLight {
  glm::dvec3 color{0};
  double opticalDepth = 0;
  glm::dvec3 meanColor{0};  // without regard to what is in front of what
};

/// The ray so far, from the front.
struct Integrator::Path {
  double opticalDepth = 0;
  glm::dvec3 color{0};
  double error = 0;

  void add(const PieceLight& piece, double pieceError) {
    const double transmittance = std::exp(-opticalDepth);
    color += transmittance * piece.color;
    error += transmittance * pieceError;
    opticalDepth += piece.opticalDepth;
  }
};

Integrator::Integrator(const Volume& volume, const Scene& scene, double tolerance)
    : dims_(volume.grid().dims),
      blend_(scene.blend),
      tolerance_(tolerance),
      worldFromVoxel_(volume.grid().worldFromVoxel),
      voxelFromWorld_(glm::inverse(worldFromVoxel_)),
      voxelZero_(volume.grid().worldFromVoxel[3]),
      lighting_(scene, voxelZero_) {
  if (scene.channels.size() != volume.channels().size())
    throw Error(ErrorCode::badInput, "reference: the scene has " + std::to_string(scene.channels.size()) +
                                         " channels, the volume " + std::to_string(volume.channels().size()));
  // Jumps inside a piece need a floor that bisection reaches soon when every point costs a ray.
  floor_ = lighting_.any() ? 1e-2 : 1e-9;
  opaqueDepth_ = lighting_.any() ? 5 - std::log(tolerance) : 27.7;
  const glm::dvec3 spacing = volume.grid().spacing();
  smallestSpacing_ = std::min({spacing.x, spacing.y, spacing.z});
  for (std::size_t n = 0; n < scene.channels.size(); ++n) {
    const ChannelAppearance& appearance = scene.channels[n];
    if (!appearance.visible) continue;
    if (!std::isfinite(appearance.weight) || appearance.weight < 0)
      throw Error(ErrorCode::badInput, "reference: a weight must be finite and not negative");
    ChannelCurves curves(appearance);
    if (!curves.visible()) continue;
    channels_.push_back({ScalarField(volume.channels()[n], dims_), std::move(curves), appearance.weight,
                         appearance.gamma != 1, appearance.material,
                         std::abs(appearance.rangeHi - appearance.rangeLo)});
  }
}

RayResult Integrator::trace(const glm::dvec3& originWorld, const glm::dvec3& directionWorld) const {
  const double length = glm::length(directionWorld);
  if (!isFinite(originWorld) || !isFinite(directionWorld) || !(length > 0))
    throw Error(ErrorCode::badInput, "reference: a ray needs a finite origin and a direction that is not 0");
  const Ray ray{originWorld - voxelZero_, directionWorld / length};
  Path all;
  if (blend_ == BlendMode::composite)
    for (const ActiveChannel& channel : channels_) {
      const Path alone = follow(ray, {&channel, 1});
      all.color += alone.color;
      all.opticalDepth += alone.opticalDepth;
      all.error += alone.error;
    }
  else
    all = follow(ray, channels_);
  return {glm::dvec4(all.color, -std::expm1(-all.opticalDepth)), all.error};
}

/// What the given channels make of a ray.
Integrator::Path Integrator::follow(const Ray& ray, Channels channels) const {
  const RayCells cells = cutAtCells(voxelFromWorld_ * ray.origin, voxelFromWorld_ * ray.direction, dims_);
  Path path;
  forEachSmoothPart(cells, dims_, blend_, channels, [&](const Stretch& stretch, double begin, double end) {
    const auto medium = [&](double u) { return mediumAt(ray, channels, stretch, u); };
    if (lighting_.any())
      integrate<4, 2>(medium, stretch.length, begin, end, path);
    else
      integrate<8, 4>(medium, stretch.length, begin, end, path);
    return path.opticalDepth <= opaqueDepth_;
  });
  if (path.opticalDepth > opaqueDepth_) path.error += std::exp(-path.opticalDepth);  // what is hidden
  return path;
}

/// Adds the part [begin, end] of a stretch.
template <int kFine, int kCoarse, class MediumAt>
void Integrator::integrate(const MediumAt& medium, double length, double begin, double end,
                           Path& path) const {
  if (path.opticalDepth > opaqueDepth_) return;
  PieceLight fine = lightOf<kFine>(medium, length, begin, end);
  if (fine.opticalDepth == 0) return;
  const double alpha = -std::expm1(-fine.opticalDepth);
  if (fine.opticalDepth <= kMaxPieceDepth) {
    const PieceLight coarse = lightOf<kCoarse>(medium, length, begin, end);
    const double error =
        std::max(largest(fine.color - coarse.color), std::abs(fine.opticalDepth - coarse.opticalDepth));
    if (error <= tolerance_ * alpha || error * std::exp(-path.opticalDepth) <= tolerance_ * floor_)
      return path.add(fine, error);
  }
  const double middle = 0.5 * (begin + end);
  if (middle <= begin || middle >= end) {  // no number in between: what is left is a surface
    fine.color = fine.meanColor * alpha;
    const PieceLight coarse = lightOf<kCoarse>(medium, length, begin, end);
    return path.add(fine, alpha * largest(fine.meanColor - coarse.meanColor));
  }
  integrate<kFine, kCoarse>(medium, length, begin, middle, path);
  integrate<kFine, kCoarse>(medium, length, middle, end, path);
}

template <int N, class MediumAt>
Integrator::PieceLight Integrator::lightOf(const MediumAt& mediumAt, double stretchLength, double begin,
                                           double end) {
  static const GaussRule<N> rule;
  const double length = (end - begin) * stretchLength;
  std::array<Medium, N> medium;
  PieceLight light;
  for (std::size_t i = 0; i < N; ++i) {
    medium[i] = mediumAt(begin + rule.node[i] * (end - begin));
    light.opticalDepth += length * rule.weight[i] * medium[i].extinction;
    light.meanColor += rule.weight[i] * medium[i].emission;
  }
  if (light.opticalDepth == 0) return light;
  light.meanColor *= length / light.opticalDepth;
  if (!(light.opticalDepth <= kMaxPieceDepth)) return light;  // will not be used
  for (std::size_t i = 0; i < N; ++i) {
    double depth = 0;
    for (std::size_t j = 0; j < N; ++j) depth += rule.toNode[i][j] * medium[j].extinction;
    light.color += length * rule.weight[i] * std::exp(-depth * length) * medium[i].emission;
  }
  return light;
}

Integrator::Medium Integrator::mediumAt(const Ray& ray, Channels channels, const Stretch& stretch,
                                        double u) const {
  ChannelSample samples[kMaxChannels];
  for (std::size_t n = 0; n < stretch.channels.size(); ++n) samples[n] = stretch.channels[n].at(u);
  const Blended blend = blended(blend_, stretch, samples);
  Medium medium{blend.extinction, glm::dvec3(0)};
  if (!lighting_.any()) {
    for (std::size_t n = 0; n < stretch.channels.size(); ++n)
      medium.emission += blend.share[n] * samples[n].color;
    return medium;
  }
  if (!(medium.extinction > 0)) return medium;
  const glm::dvec3 pointVoxel = stretch.point(u);
  std::vector<ArrivingLight> lights = lighting_.arriving(worldFromVoxel_ * pointVoxel, ray.origin);
  if (lighting_.shadows())
    for (ArrivingLight& light : lights)
      light.visibility = transmittance(pointVoxel, light.direction, light.distance, channels);
  for (std::size_t n = 0; n < stretch.channels.size(); ++n) {
    if (!(blend.share[n] > 0)) continue;
    const ActiveChannel& channel = *stretch.channels[n].channel;
    glm::dvec3 gradient(0);
    if (lighting_.shading()) gradient = glm::transpose(voxelFromWorld_) * channel.field.gradient(pointVoxel);
    const double change = glm::length(gradient) * smallestSpacing_;
    const double steepness = change > 0 ? change / channel.range : 0.0;
    medium.emission += blend.share[n] * lighting_.radiance(channel.material, samples[n].color, gradient,
                                                           steepness, -ray.direction, lights);
  }
  return medium;
}

/// Of the given channels between a point and a light.
double Integrator::transmittance(const glm::dvec3& pointVoxel, const glm::dvec3& direction, double distance,
                                 Channels channels) const {
  if (!(distance > 0)) return 1;
  double depth = 0;
  const double dark = 3 - std::log(tolerance_);  // no light that counts
  forEachSmoothPart(cutAtCells(pointVoxel, voxelFromWorld_ * direction, dims_, distance), dims_, blend_,
                    channels, [&](const Stretch& stretch, double begin, double end) {
                      depth += opticalDepth(stretch, begin, end);
                      return depth <= dark;
                    });
  return depth <= dark ? std::exp(-depth) : 0.0;
}

/// Of a part of a stretch.
double Integrator::opticalDepth(const Stretch& stretch, double begin, double end) const {
  const auto rule = [&]<int N>(const GaussRule<N>& gauss) {
    ChannelSample samples[kMaxChannels];
    double sum = 0;
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t n = 0; n < stretch.channels.size(); ++n)
        samples[n] = stretch.channels[n].at(begin + gauss.node[i] * (end - begin));
      sum += gauss.weight[i] * blended(blend_, stretch, samples).extinction;
    }
    return sum * (end - begin) * stretch.length;
  };
  static const GaussRule<2> two;
  static const GaussRule<4> four;
  const double coarse = rule(two);
  const auto bent = [](const ChannelInCell& channel) { return channel.channel->bent; };
  if (std::none_of(stretch.channels.begin(), stretch.channels.end(), bent))
    return coarse;  // of a cubic: exact
  const double fine = rule(four), middle = 0.5 * (begin + end);
  // A ray has some hundred parts, and a relative error counts at most depth x exp(-depth) times.
  if (std::abs(fine - coarse) <= tolerance_ * std::max(1e-3, 1e-2 * fine) || middle <= begin || middle >= end)
    return fine;
  return opticalDepth(stretch, begin, middle) + opticalDepth(stretch, middle, end);
}

RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld) {
  return Integrator(volume, scene).trace(originWorld, directionWorld);
}

}  // namespace scolopax::reference
