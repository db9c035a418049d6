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
#include "renderer/reference/channel_curves.h"
#include "renderer/reference/clipping.h"
#include "renderer/reference/gradient_factor.h"
#include "renderer/reference/ray_cells.h"
#include "renderer/reference/scalar_along.h"
#include "renderer/reference/scalar_field.h"
#include "renderer/reference/surfaces.h"

namespace scolopax::reference {

/// A visible channel.
struct ActiveChannel {
  int number;  ///< in the volume
  ScalarField field;
  ChannelCurves curves;
  double weight;  ///< in blend mode mix
  bool bent;      ///< by cubic interpolation, gamma or a factor: extinction along a ray is no piecewise cubic
  Material material;
  double range;                            ///< |hi - lo|, data units
  std::optional<GradientFactor> factor{};  ///< of the opacity
  std::vector<Surface> surfaces{};
};

/// A channel along a stretch, and the piece of its curves that applies.
struct ChannelInCell {
  const ActiveChannel* channel;
  ScalarAlong scalar;
  std::optional<FactorAlong> factor{};
  std::size_t piece = 0;
  ChannelSample at(double u) const {
    ChannelSample sample = channel->curves.sample(piece, channel->curves.position(scalar(u)));
    if (factor && sample.extinction > 0) sample.extinction *= (*factor)(u);
    return sample;
  }
};

/// The stretch of a ray between two neighbouring cuts, inside one cell, u in [0,1].
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
/// extinction; stops when visit returns false. `ray` must already be cut at the planes of `clipping`, and for
/// nearest at the faces of voxels.
void forEachSmoothPart(const RayCells& ray, const glm::ivec3& dims, const Clipping& clipping, BlendMode blend,
                       std::span<const ActiveChannel> channels,
                       const std::function<bool(const Stretch&, double begin, double end)>& visit);

}  // namespace scolopax::reference
