// SPDX-License-Identifier: Apache-2.0
// The part of a ray inside one cell, with everything that blending and lighting need there; and the parts of
// a ray in which nothing has a kink or a jump.
#pragma once
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/reference/cell_scalar.h"
#include "renderer/reference/channel_curves.h"
#include "renderer/reference/clipping.h"
#include "renderer/reference/gradient_factor.h"
#include "renderer/reference/ray_cells.h"
#include "renderer/reference/scalar_field.h"
#include "renderer/reference/surfaces.h"

namespace scolopax::reference {

/// A visible channel.
struct ActiveChannel {
  int number;  ///< in the volume
  ScalarField field;
  ChannelCurves curves;
  double weight;  ///< in blend mode mix
  bool bent;      ///< by gamma or a factor: extinction along a ray is no piecewise cubic
  Material material;
  double range;                            ///< |hi - lo|, data units
  std::optional<GradientFactor> factor{};  ///< of the opacity
  std::vector<Surface> surfaces{};
};

/// A channel along a stretch, and the piece of its curves that applies.
struct ChannelInCell {
  const ActiveChannel* channel;
  CellScalar scalar;
  std::optional<FactorAlong> factor{};
  std::size_t piece = 0;
  ChannelSample at(double u) const {
    ChannelSample sample = channel->curves.sample(piece, channel->curves.position(scalar(u)));
    if (factor && sample.extinction > 0) sample.extinction *= (*factor)(u);
    return sample;
  }
};

/// The part of a ray between two neighbouring cuts, and the cell of eight voxels in which it lies. In the
/// outer half voxels, where values are clamped to the edge, that is the outermost cell.
struct CellOnRay {
  CellOnRay(const RayCells& ray, double begin, double end, const glm::ivec3& dims);
  glm::dvec3 middle;      ///< voxel coordinates
  glm::dvec3 cell;        ///< its first voxel
  glm::dvec3 begin, end;  ///< in the cell's coordinates, [0,1]^3
};

/// One cell's stretch of a ray, u in [0,1].
struct Stretch {
  double start = 0;                     ///< t of u = 0
  double length = 0;                    ///< world units
  glm::dvec3 begin{0}, end{0};          ///< voxel coordinates
  std::vector<ChannelInCell> channels;  ///< those that are finite, not clipped and not of factor 0 here
  glm::dvec3 point(double u) const { return begin + u * (end - begin); }
};

/// Relative difference below which extinctions count as equal: the size of rounding errors.
inline constexpr double kEqualExtinction = 1e-12;

/// Calls visit(stretch, begin, end) front to back for every part [begin, end] of u in which extinction and
/// colour of all channels are smooth and, in max and mix, one and the same channel has the largest
/// extinction; stops when visit returns false. `ray` must already be cut at the planes of `clipping`.
void forEachSmoothPart(const RayCells& ray, const glm::ivec3& dims, const Clipping& clipping, BlendMode blend,
                       std::span<const ActiveChannel> channels,
                       const std::function<bool(const Stretch&, double begin, double end)>& visit);

}  // namespace scolopax::reference
