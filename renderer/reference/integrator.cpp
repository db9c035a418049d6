// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <string>
#include <unordered_map>

#include "renderer/core/error.h"
#include "renderer/core/is_finite.h"
#include "renderer/reference/gauss_rule.h"

namespace scolopax::reference {
namespace {

constexpr double kShadowError = 0.02;  // share of the tolerance, for the light that arrives
constexpr double kSamePlace = 1e-9;    // smallest spacings within which two surfaces coincide

/// The channels at a point, blended.
struct Blended {
  double extinction = 0;                     // per world unit
  std::array<double, kMaxChannels> share{};  // weight of each channel's radiance in extinction x radiance
};

/// The blend modes: one case each.
Blended blended(BlendMode mode, const Stretch& stretch, const ChannelSample* samples) {
  Blended result;
  const std::size_t count = stretch.channels.size();
  // Of equal channels the first counts, even if rounding makes them differ. Otherwise channels of one field
  // over different ranges would take turns at every point, and bisection would not end.
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

}  // namespace

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
  void addSurface(double opacity, const glm::dvec3& radiance) {
    color += std::exp(-opticalDepth) * opacity * radiance;
    opticalDepth -= std::log1p(-opacity);
  }
};

Integrator::Integrator(const Volume& volume, const Scene& scene, double tolerance)
    : dims_(volume.grid().dims),
      blend_(scene.blend),
      tolerance_(tolerance),
      worldFromVoxel_(volume.grid().worldFromVoxel),
      voxelFromWorld_(glm::inverse(worldFromVoxel_)),
      voxelZero_(volume.grid().worldFromVoxel[3]),
      clipping_(scene, volume.grid()),
      lighting_(scene, voxelZero_),
      lightCuts_(lighting_, worldFromVoxel_, 1e-2 * tolerance) {
  if (scene.channels.size() != volume.channels().size())
    throw Error(ErrorCode::badInput, "reference: the scene has " + std::to_string(scene.channels.size()) +
                                         " channels, the volume " + std::to_string(volume.channels().size()));
  // Edges of shadows need a floor that bisection reaches soon, because every point costs a ray.
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
    std::optional<GradientFactor> factor;
    if (appearance.gradientOpacity)
      factor.emplace(*appearance.gradientOpacity, glm::transpose(voxelFromWorld_));
    const std::vector<Surface> surfaces = surfacesOf(appearance, curves, smallestSpacing_);
    double brightest = curves.brightest();
    for (const Surface& s : surfaces) brightest = std::max({brightest, s.color.x, s.color.y, s.color.z});
    if (appearance.peaks == Peaks::only || (factor && !factor->visible())) {
      ChannelAppearance surfacesAlone = appearance;
      for (OpacityKnot& knot : surfacesAlone.opacity) knot.value = 0;
      curves = ChannelCurves(surfacesAlone);
      factor.reset();
    }
    if (!curves.visible() && surfaces.empty()) continue;
    const double radiance = lighting_.brightest(appearance.material, brightest);
    brightest_ = blend_ == BlendMode::mix ? brightest_ + std::max(1.0, appearance.weight) * radiance
                                          : std::max(brightest_, radiance);
    const bool bent = appearance.interpolation == Interpolation::cubic || appearance.gamma != 1 || factor;
    channels_.push_back({int(n), ScalarField(volume.channels()[n], dims_, appearance.interpolation),
                         std::move(curves), appearance.weight, bent, appearance.material,
                         std::abs(appearance.rangeHi - appearance.rangeLo), std::move(factor), surfaces});
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

/// Cuts a ray where the scalars of the given channels have kinks or jumps, and at clip and crop planes.
RayCells Integrator::cutAtAll(const glm::dvec3& originVoxel, const glm::dvec3& directionWorld, double length,
                              Channels channels) const {
  const bool nearest = std::any_of(channels.begin(), channels.end(), [](const ActiveChannel& channel) {
    return channel.field.interpolation() == Interpolation::nearest;
  });
  RayCells cells = cutAtCells(originVoxel, voxelFromWorld_ * directionWorld, dims_, length,
                              nearest ? CutAt::voxelCentresAndFaces : CutAt::voxelCentres);
  clipping_.cut(cells);
  return cells;
}

/// Integrates the given channels along a ray.
Integrator::Path Integrator::follow(const Ray& ray, Channels channels) const {
  RayCells cells = cutAtAll(voxelFromWorld_ * ray.origin, ray.direction,
                            std::numeric_limits<double>::infinity(), channels);
  const std::vector<Crossing> crossings = crossingsOf(cells, dims_, clipping_, channels);
  for (const Crossing& crossing : crossings) cells.cuts.push_back(crossing.t);
  std::sort(cells.cuts.begin(), cells.cuts.end());
  Path path;
  std::size_t met = 0;  // crossings behind
  const auto meetUpTo = [&](double t) {
    for (; met < crossings.size() && crossings[met].t <= t && path.opticalDepth <= opaqueDepth_; ++met)
      meet(ray, cells, crossings[met], channels, path);
  };
  forEachSmoothPart(cells, dims_, clipping_, blend_, channels,
                    [&](const Stretch& stretch, double begin, double end) {
                      meetUpTo(stretch.start);
                      const auto medium = [&](double u) { return mediumAt(ray, channels, stretch, u); };
                      if (lighting_.any()) {
                        const std::vector<double> cuts = lightCuts_.of(stretch, begin, end, ray.direction);
                        for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
                          // Evaluates a step away from the cuts, and every point only once, because it may
                          // cost rays.
                          const double step = 1e-9 * (cuts[k + 1] - cuts[k]);
                          std::unordered_map<double, Medium> known;
                          const auto inside = [&](double u) {
                            const auto [place, isNew] = known.try_emplace(u);
                            if (isNew)
                              place->second = medium(std::clamp(u, cuts[k] + step, cuts[k + 1] - step));
                            return place->second;
                          };
                          integrate(roughPiece, inside, stretch.length, cuts[k], cuts[k + 1], path);
                        }
                      } else {
                        integrate(smoothPiece, medium, stretch.length, begin, end, path);
                      }
                      return path.opticalDepth <= opaqueDepth_;
                    });
  meetUpTo(std::numeric_limits<double>::infinity());
  if (path.opticalDepth > opaqueDepth_)  // what lies behind adds at most this
    path.error += std::exp(-path.opticalDepth) * std::max(1.0, brightest_);
  if (lighting_.shadows())
    path.error -= kShadowError * tolerance_ * brightest_ * std::expm1(-path.opticalDepth);
  return path;
}

/// Adds a surface to the path.
void Integrator::meet(const Ray& ray, const RayCells& cells, const Crossing& crossing, Channels channels,
                      Path& path) const {
  const ActiveChannel& channel = *crossing.channel;
  glm::dvec3 radiance = crossing.surface->color;
  if (lighting_.any()) {
    const glm::dvec3 point = cells.origin + crossing.t * cells.direction;
    glm::dvec3 gradient(0);
    if (lighting_.shading()) gradient = glm::transpose(voxelFromWorld_) * channel.field.gradient(point);
    radiance = lighting_.radiance(channel.material, radiance, gradient, gradient == glm::dvec3(0) ? 0 : 1,
                                  -ray.direction, lightsAt(point, true, ray.origin, channels));
  }
  path.addSurface(crossing.surface->opacity, radiance);
}

/// The lights as they arrive at a point.
std::vector<ArrivingLight> Integrator::lightsAt(const glm::dvec3& pointVoxel, bool onSurface,
                                                const glm::dvec3& eye, Channels channels) const {
  std::vector<ArrivingLight> lights = lighting_.arriving(worldFromVoxel_ * pointVoxel, eye);
  if (lighting_.shadows())
    for (ArrivingLight& light : lights)
      light.visibility = transmittance(pointVoxel, onSurface, light.direction, light.distance, channels);
  return lights;
}

/// Adds the part [begin, end] of a stretch to the path, bisected until its error is small enough.
void Integrator::integrate(Rule& rule, const MediumAt& mediumAt, double stretchLength, double begin,
                           double end, Path& path) const {
  if (path.opticalDepth > opaqueDepth_) return;
  const double middle = 0.5 * (begin + end);
  PieceEstimate piece = rule([&](double w) { return mediumAt(w == 0.5 ? middle : std::lerp(begin, end, w)); },
                             (end - begin) * stretchLength);
  if (piece.light.opticalDepth == 0) return;
  const double alpha = -std::expm1(-piece.light.opticalDepth);
  if (piece.light.opticalDepth <= kMaxPieceDepth &&
      (piece.error <= tolerance_ * alpha ||
       piece.error * std::exp(-path.opticalDepth) <= tolerance_ * floor_))
    return path.add(piece.light, piece.error);
  if (middle <= begin || middle >= end) {  // no number in between: the rest is a surface
    piece.light.color = piece.light.meanColor * alpha;
    return path.add(piece.light, alpha * piece.meanError);
  }
  integrate(rule, mediumAt, stretchLength, begin, middle, path);
  integrate(rule, mediumAt, stretchLength, middle, end, path);
}

Medium Integrator::mediumAt(const Ray& ray, Channels channels, const Stretch& stretch, double u) const {
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
  const std::vector<ArrivingLight> lights = lightsAt(pointVoxel, false, ray.origin, channels);
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

/// Transmittance of the given channels between a point and a light. `onSurface`: the point lies on a surface,
/// which does not shadow it.
double Integrator::transmittance(const glm::dvec3& pointVoxel, bool onSurface, const glm::dvec3& direction,
                                 double distance, Channels channels) const {
  if (!(distance > 0)) return 1;
  const RayCells cells = cutAtAll(pointVoxel, direction, distance, channels);
  double passes = 1;
  for (const Crossing& crossing : crossingsOf(cells, dims_, clipping_, channels))
    if (!onSurface || crossing.t > cells.cuts.front() + kSamePlace * smallestSpacing_)
      passes *= 1 - crossing.surface->opacity;
  if (passes == 0) return 0;
  // A third of kShadowError each: for ending in the dark, for the absolute errors of all cells on the way,
  // and for the relative error of the whole depth.
  const double dark = -std::log(kShadowError / 3 * tolerance_);
  const double allowed = kShadowError / 3 * tolerance_ / double(std::max<std::size_t>(cells.cuts.size(), 1));
  double depth = 0;
  forEachSmoothPart(cells, dims_, clipping_, blend_, channels,
                    [&](const Stretch& stretch, double begin, double end) {
                      depth += opticalDepth(stretch, begin, end, allowed * (end - begin));
                      return depth <= dark;
                    });
  return depth <= dark ? passes * std::exp(-depth) : 0.0;
}

/// Optical depth of a part of a stretch.
double Integrator::opticalDepth(const Stretch& stretch, double begin, double end, double allowed) const {
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
    return coarse;  // exact for a cubic
  const double fine = rule(four), middle = 0.5 * (begin + end), error = std::abs(fine - coarse);
  // In the transmittance, a relative error of the depth is multiplied by depth x exp(-depth), which is less
  // than 1.
  if (error <= allowed || error <= kShadowError / 3 * tolerance_ * fine || middle <= begin || middle >= end)
    return fine;
  return opticalDepth(stretch, begin, middle, allowed / 2) + opticalDepth(stretch, middle, end, allowed / 2);
}

RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld) {
  return Integrator(volume, scene).trace(originWorld, directionWorld);
}

}  // namespace scolopax::reference
