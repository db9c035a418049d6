// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/light_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

namespace scolopax::reference {
namespace {

constexpr double kNarrowest = 0x1p-20;  // share of the part, below which directions may turn at will
constexpr double kSame = 1e-11;         // distance of cuts, below which they are one
constexpr double kMostTurn = 0.5;       // of directions in half a piece, radians
constexpr double kSmoothPower = 8;      // max(x, 0) to this power is smooth enough for the rules

double angleBetween(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

/// A part of a ray in world space, w from 0 to 1.
struct LightCuts::Line {
  glm::dvec3 begin, end, toViewer;
  glm::dvec3 point(double w) const { return begin + w * (end - begin); }
  /// Vector from the line to a point.
  BernsteinVector to(const glm::dvec3& p) const {
    const auto linear = [](double a, double b) { return Bernstein(std::array{a, b}); };
    return {linear(p.x - begin.x, p.x - end.x), linear(p.y - begin.y, p.y - end.y),
            linear(p.z - begin.z, p.z - end.z)};
  }
  /// Direction to a light.
  glm::dvec3 toLight(const Light& light, double w) const {
    switch (light.type) {
      case LightType::directional:
        return -unit(light.vector);
      case LightType::point:
        return unit(light.vector - point(w));
      case LightType::headlight:
        break;
    }
    return toViewer;
  }
};

/// A channel whose light depends on its gradient.
struct LightCuts::Shaded {
  const ActiveChannel& channel;
  GradientAlong gradient;
  double longest;  // of gradient.scaled
};

LightCuts::LightCuts(Lighting lighting, const glm::dmat3& worldFromVoxel, double faintest)
    : lighting_(std::move(lighting)),
      worldFromVoxel_(worldFromVoxel),
      worldFromGradient_(glm::transpose(glm::inverse(worldFromVoxel))),
      smallestSpacing_(std::min(
          {glm::length(worldFromVoxel[0]), glm::length(worldFromVoxel[1]), glm::length(worldFromVoxel[2])})),
      faintest_(faintest) {}

std::vector<double> LightCuts::of(const Stretch& stretch, double begin, double end,
                                  const glm::dvec3& rayDirection) const {
  const glm::dvec3 first = stretch.point(begin), last = stretch.point(end);
  const Line line{worldFromVoxel_ * first, worldFromVoxel_ * last, -rayDirection};
  std::vector<Shaded> shaded;
  std::vector<double> cuts{0, 1};
  if (lighting_.shading())
    for (const ChannelInCell& channel : stretch.channels) {
      const auto extinction = [&](double w) { return channel.at(begin + w * (end - begin)).extinction; };
      if (!(extinction(0.3) > 0 || extinction(0.7) > 0)) continue;  // a curve's piece that is 0 throughout
      const auto gradient = gradientAlong(channel.channel->field, first, last, worldFromGradient_);
      if (!gradient) continue;
      shaded.push_back({*channel.channel, *gradient, gradient->scaled.longest()});
      if (shaded.back().longest > 0)
        appendKinks(line, shaded.back(), cuts);
      else
        shaded.pop_back();
    }
  std::sort(cuts.begin(), cuts.end());
  std::vector<double> refined{0};
  for (const double cut : cuts)  // some come twice, within rounding
    if (cut == 1 || (cut > refined.back() + kSame && cut < 1 - kSame))
      refine(line, shaded, refined.back(), cut, refined);
  for (double& w : refined) w = begin + w * (end - begin);
  refined.back() = end;
  return refined;
}

/// Appends the points where the normal flips, where n.l and n.h pass zero, and where the fade saturates.
void LightCuts::appendKinks(const Line& line, const Shaded& shaded, std::vector<double>& cuts) const {
  const BernsteinVector& normal = shaded.gradient.scaled;
  const Material& material = shaded.channel.material;
  const bool diffuse = material.diffuse > 0;
  const bool edge =
      material.specular > 0 && material.shininess < kSmoothPower;  // highlights have a kink at their edge
  const double noise = kPolynomialNoise * shaded.longest;

  const Bernstein nv = normal.dot(line.toViewer);
  nv.appendSignChanges(noise, cuts);
  for (const Light& light : lighting_.lights()) {
    if (light.type == LightType::directional) {
      const glm::dvec3 l = line.toLight(light, 0);
      if (diffuse) normal.dot(l).appendSignChanges(noise, cuts);
      if (edge) normal.dot(l + line.toViewer).appendSignChanges(noise, cuts);
    } else if (light.type == LightType::point) {
      const BernsteinVector toLight = line.to(light.vector);
      const Bernstein nl = normal.dot(toLight);
      const double farthest = toLight.longest();
      if (diffuse) nl.appendSignChanges(noise * farthest, cuts);
      // n.h = 0 where n.l = -n.v, with l of length 1: squared, this is a polynomial.
      if (edge)
        (nl * nl - nv * nv * toLight.dot(toLight))
            .appendSignChanges(noise * shaded.longest * farthest * farthest, cuts);
    }  // a headlight shines along the view: cut at n.v above
  }
  const Bernstein& scale = shaded.gradient.scale;
  const double steep = shaded.channel.range / smallestSpacing_;
  const double most = scale.upper() * steep;
  (normal.dot(normal) - scale * scale * (steep * steep))
      .appendSignChanges(kPolynomialNoise * std::max(shaded.longest * shaded.longest, most * most), cuts);
}

/// Appends `end`, after the cuts that are needed before it.
void LightCuts::refine(const Line& line, const std::vector<Shaded>& shaded, double begin, double end,
                       std::vector<double>& cuts) const {
  const double middle = 0.5 * (begin + end);
  if (end - begin > kNarrowest && !isResolved(line, shaded, begin, end)) {
    refine(line, shaded, begin, middle, cuts);
    refine(line, shaded, middle, end, cuts);
  } else {
    cuts.push_back(end);
  }
}

/// Whether a piece needs no more cuts.
bool LightCuts::isResolved(const Line& line, const std::vector<Shaded>& shaded, double begin,
                           double end) const {
  for (const Light& light : lighting_.lights())
    if (light.type == LightType::point &&
        !(angleBetween(light.vector - line.point(begin), light.vector - line.point(end)) <= 2 * kMostTurn))
      return false;
  return std::all_of(shaded.begin(), shaded.end(),
                     [&](const Shaded& s) { return isNormalResolved(line, s, begin, end); });
}

/// Whether all that depends on a channel's normal changes slowly in a piece.
bool LightCuts::isNormalResolved(const Line& line, const Shaded& shaded, double begin, double end) const {
  const Material& material = shaded.channel.material;
  const BernsteinVector piece = shaded.gradient.scaled.between(begin, end);
  const Bernstein scale = shaded.gradient.scale.between(begin, end);
  const double steepest = piece.longest() / scale.lower();
  if (2 * steepest * smallestSpacing_ <= faintest_ * shaded.channel.range) return true;

  // All normals of the piece lie in a cone around that of its middle.
  const glm::dvec3 middle = piece(0.5);
  double turn = 0;
  for (const glm::dvec3& control : piece.controlPoints())
    if (glm::length(control) > 10 * kPolynomialNoise * shaded.longest)
      turn = std::max(turn, angleBetween(control, middle));
  if (turn > kMostTurn) return false;
  if (!(material.specular > 0)) return true;

  const double width = std::sqrt(2 / material.shininess);  // of a highlight, radians
  const double centre = 0.5 * (begin + end);
  const glm::dvec3 normal = glm::dot(middle, line.toViewer) < 0 ? -middle : middle;
  for (const Light& light : lighting_.lights()) {
    const auto half = [&](double w) { return line.toLight(light, w) + line.toViewer; };
    const glm::dvec3 h = half(centre);
    const double turns = turn + std::max(angleBetween(half(begin), h), angleBetween(h, half(end)));
    if (turns <= width) continue;
    const double nearest = std::max(angleBetween(normal, h) - turns, 0.0);
    if (nearest < 1.57 && material.shininess * std::log(std::cos(nearest)) > std::log(faintest_))
      return false;
  }
  return true;
}

}  // namespace scolopax::reference
