// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/integrator.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "renderer/core/error.h"
#include "renderer/reference/cell_scalar.h"
#include "renderer/reference/gauss_rule.h"
#include "renderer/reference/ray_cells.h"

namespace scolopax::reference {
namespace {

constexpr double kOpaqueDepth = 27.7;  // T < 1e-12: what lies behind is not looked at
constexpr double kMaxPieceDepth = 4;   // a piece of the ray thicker than this is bisected unseen
constexpr double kFloor = 1e-9;        // of the tolerance: absolute error that a piece may always have

/// What a point of the ray does to the light on its way.
struct Medium {
  double extinction = 0;   // per world unit
  glm::dvec3 emission{0};  // extinction times radiance
};

/// The blend modes: one case each.
Medium blended(BlendMode mode, const ChannelSample* samples, std::size_t count) {
  Medium medium;
  switch (mode) {
    case BlendMode::max:
    case BlendMode::mix:
    case BlendMode::composite:  // TEMP
    case BlendMode::density:
      for (std::size_t n = 0; n < count; ++n) {
        medium.extinction += samples[n].extinction;
        medium.emission += samples[n].extinction * samples[n].color;
      }
  }
  return medium;
}

/// A channel along one cell, and the piece of its curves that holds between two neighbouring cuts.
struct ChannelInCell {
  const ChannelCurves* curves;
  CellScalar scalar;
  std::size_t piece = 0;
};

/// One cell's stretch of the ray, u in [0,1].
struct Stretch {
  BlendMode blend;
  double length;  // world units
  std::vector<ChannelInCell> channels;

  Medium at(double u) const {
    ChannelSample samples[kMaxChannels];
    for (std::size_t n = 0; n < channels.size(); ++n) {
      const ChannelInCell& channel = channels[n];
      samples[n] = channel.curves->sample(channel.piece, channel.curves->position(channel.scalar(u)));
    }
    return blended(blend, samples, channels.size());
  }
};

/// Light that a piece of the ray adds as seen from its beginning, and how thick it is.
struct PieceLight {
  glm::dvec3 color{0};
  double opticalDepth = 0;
  glm::dvec3 meanColor{0};  // without regard to what is in front of what
};

template <int N>
PieceLight lightOf(const Stretch& stretch, double begin, double end) {
  static const GaussRule<N> rule;
  const double length = (end - begin) * stretch.length;
  std::array<Medium, N> medium;
  PieceLight light;
  for (std::size_t i = 0; i < N; ++i) {
    medium[i] = stretch.at(begin + rule.node[i] * (end - begin));
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

/// The ray so far, from the front.
struct Path {
  double tolerance;
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

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Adds the part [begin, end] of a stretch, in which every curve is smooth.
void integrate(const Stretch& stretch, double begin, double end, Path& path) {
  if (path.opticalDepth > kOpaqueDepth) return;
  PieceLight fine = lightOf<8>(stretch, begin, end);
  if (fine.opticalDepth == 0) return;
  const double alpha = -std::expm1(-fine.opticalDepth);
  if (fine.opticalDepth <= kMaxPieceDepth) {
    const PieceLight coarse = lightOf<4>(stretch, begin, end);
    const double error =
        std::max(largest(fine.color - coarse.color), std::abs(fine.opticalDepth - coarse.opticalDepth));
    if (error <= path.tolerance * alpha || error * std::exp(-path.opticalDepth) <= path.tolerance * kFloor)
      return path.add(fine, error);
  }
  const double middle = 0.5 * (begin + end);
  if (middle <= begin || middle >= end) {  // no number in between: what is left is a surface
    fine.color = fine.meanColor * alpha;
    return path.add(fine, alpha * largest(fine.meanColor - lightOf<4>(stretch, begin, end).meanColor));
  }
  integrate(stretch, begin, middle, path);
  integrate(stretch, middle, end, path);
}

/// Data value of a voxel; not finite when the voxel is not.
double voxel(const Channel& channel, std::size_t index) {
  const double stored = visitScalarType(
      channel.voxels.type(), [&](auto zero) { return double(channel.voxels.as<decltype(zero)>()[index]); });
  return channel.slope * stored + channel.intercept;
}

/// The eight voxels at the corners of the cell that begins at `cell`, x fastest (where there is one layer
/// only, it is both); false when one of them is not finite.
bool fetchCorners(const Channel& channel, const glm::ivec3& dims, const glm::ivec3& cell,
                  std::array<double, 8>& corners) {
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 offset(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const glm::ivec3 p = glm::min(cell + offset, dims - 1);
    const std::size_t index =
        std::size_t(p.x) + std::size_t(dims.x) * (std::size_t(p.y) + std::size_t(dims.y) * std::size_t(p.z));
    corners[std::size_t(corner)] = voxel(channel, index);
    if (!std::isfinite(corners[std::size_t(corner)])) return false;
  }
  return true;
}

bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Integrator::Integrator(const Volume& volume, const Scene& scene, double tolerance)
    : volume_(volume),
      blend_(scene.blend),
      tolerance_(tolerance),
      voxelFromWorld_(glm::inverse(glm::dmat3(volume.grid().worldFromVoxel))),
      voxelZero_(volume.grid().worldFromVoxel[3]) {
  if (scene.channels.size() != volume.channels().size())
    throw Error(ErrorCode::badInput, "reference: the scene has " + std::to_string(scene.channels.size()) +
                                         " channels, the volume " + std::to_string(volume.channels().size()));
  for (std::size_t n = 0; n < scene.channels.size(); ++n) {
    if (!scene.channels[n].visible) continue;
    ChannelCurves curves(scene.channels[n]);
    if (curves.visible()) channels_.push_back({&volume.channels()[n], std::move(curves)});
  }
}

RayResult Integrator::trace(const glm::dvec3& originWorld, const glm::dvec3& directionWorld) const {
  const double length = glm::length(directionWorld);
  if (!isFinite(originWorld) || !isFinite(directionWorld) || !(length > 0))
    throw Error(ErrorCode::badInput, "reference: a ray needs a finite origin and a direction that is not 0");
  const glm::ivec3 dims = volume_.grid().dims;
  const RayCells ray = cutAtCells(voxelFromWorld_ * (originWorld - voxelZero_),
                                  voxelFromWorld_ * (directionWorld / length), dims);
  Path path{tolerance_};
  std::vector<double> cuts;
  Stretch stretch{blend_, 0, {}};
  for (std::size_t i = 0; i + 1 < ray.cuts.size() && path.opticalDepth <= kOpaqueDepth; ++i) {
    const double begin = ray.cuts[i], end = ray.cuts[i + 1];
    if (!(begin < end)) continue;
    // Cell [cell, cell+1) between voxel centres; the outer half voxels, where values are clamped to the edge,
    // belong to the outermost cells.
    const glm::dvec3 cell = glm::clamp(glm::floor(ray.origin + 0.5 * (begin + end) * ray.direction),
                                       glm::dvec3(0), glm::max(glm::dvec3(dims) - 2.0, 0.0));
    const auto inCell = [&](double t) {
      return glm::clamp(ray.origin + t * ray.direction - cell, glm::dvec3(0), glm::dvec3(1));
    };
    stretch.length = end - begin;
    stretch.channels.clear();
    cuts = {0, 1};
    for (const ActiveChannel& channel : channels_) {
      std::array<double, 8> corners;
      if (!fetchCorners(*channel.data, dims, glm::ivec3(cell), corners)) continue;
      stretch.channels.push_back({&channel.curves, CellScalar(corners, inCell(begin), inCell(end))});
      for (const double value : channel.curves.breakpoints())
        stretch.channels.back().scalar.appendCrossings(value, cuts);
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t j = 0; j + 1 < cuts.size(); ++j) {
      if (!(cuts[j] < cuts[j + 1])) continue;
      for (ChannelInCell& channel : stretch.channels) {
        const double middle = channel.scalar(0.5 * (cuts[j] + cuts[j + 1]));
        channel.piece = channel.curves->pieceAt(channel.curves->position(middle));
      }
      integrate(stretch, cuts[j], cuts[j + 1], path);
    }
  }
  const double hidden = path.opticalDepth > kOpaqueDepth ? std::exp(-path.opticalDepth) : 0.0;
  return {glm::dvec4(path.color, -std::expm1(-path.opticalDepth)), path.error + hidden};
}

RayResult traceReference(const Volume& volume, const Scene& scene, const glm::dvec3& originWorld,
                         const glm::dvec3& directionWorld) {
  return Integrator(volume, scene).trace(originWorld, directionWorld);
}

}  // namespace scolopax::reference
