// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/clip_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/is_finite.h"
#include "renderer/kernel/views.h"

namespace scolopax {
namespace {

bool keepsRegion(std::uint32_t regions, int x, int y, int z) { return regions >> (x + 3 * y + 9 * z) & 1; }

/// The box that the kept regions of a crop span, and whether they fill it.
struct Kept {
  glm::dvec3 low, high;
  bool whole;
};
/// None if no kept region has any volume.
std::optional<Kept> keptBox(const Crop& crop, const glm::dvec3& low, const glm::dvec3& high) {
  const std::array<glm::dvec3, 4> at{low, glm::clamp(crop.low, low, high), glm::clamp(crop.high, low, high),
                                     high};
  const auto isEmpty = [&](int axis, int i) {
    return !(at[std::size_t(i)][axis] < at[std::size_t(i + 1)][axis]);
  };
  glm::ivec3 first(3), last(-1);
  const auto forEachRegion = [&](auto&& f) {
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x)
          if (!isEmpty(0, x) && !isEmpty(1, y) && !isEmpty(2, z)) f(glm::ivec3(x, y, z));
  };
  forEachRegion([&](glm::ivec3 r) {
    if (!keepsRegion(crop.regions, r.x, r.y, r.z)) return;
    first = glm::min(first, r);
    last = glm::max(last, r);
  });
  if (last.x < 0) return std::nullopt;
  Kept kept{{}, {}, true};
  for (int axis = 0; axis < 3; ++axis) {
    kept.low[axis] = at[std::size_t(first[axis])][axis];
    kept.high[axis] = at[std::size_t(last[axis] + 1)][axis];
  }
  forEachRegion([&](glm::ivec3 r) {
    const bool inside = glm::clamp(r, first, last) == r;
    if (inside && !keepsRegion(crop.regions, r.x, r.y, r.z)) kept.whole = false;
  });
  return kept;
}

/// Transforms a plane to voxel space, where its normal has length 1.
kernel::ClipPlaneView viewOf(const ClipPlane& plane, const Grid& grid, std::uint32_t channels) {
  const glm::dvec3 unit =
      plane.normal / std::max({std::abs(plane.normal.x), std::abs(plane.normal.y), std::abs(plane.normal.z)});
  glm::dvec3 normal = glm::transpose(glm::dmat3(grid.worldFromVoxel)) * unit;
  double offset = glm::dot(unit, glm::dvec3(grid.worldFromVoxel[3]) - plane.point);
  const double length = glm::length(normal);
  normal /= length;
  offset /= length;
  constexpr double kFarthest = 1e30;  // so far away that the whole volume is on one side
  return {glm::vec3(normal), float(std::clamp(offset, -kFarthest, kFarthest)), channels};
}

}  // namespace

void checkClipping(std::span<const ClipPlane> planes, const std::optional<Crop>& crop, std::size_t channels) {
  if (planes.size() > std::size_t(kernel::kMaxClipPlanes))
    failBadInput("clip: expected at most " + std::to_string(kernel::kMaxClipPlanes) + " planes, found " +
                 std::to_string(planes.size()));
  for (const ClipPlane& plane : planes) {
    if (!std::isfinite(glm::length(plane.point)) || !isFinite(plane.normal))
      failBadInput("clip: point, normal and the length of the point must be finite");
    if (plane.normal == glm::dvec3(0)) failBadInput("clip: the normal must not be zero");
    for (const int channel : plane.channels.value_or(std::vector<int>()))
      if (channel < 0 || std::size_t(channel) >= channels)
        failBadInput("clip: expected a channel below " + std::to_string(channels) + ", found " +
                     std::to_string(channel));
  }
  if (!crop) return;
  if (!isFinite(crop->low) || !isFinite(crop->high)) failBadInput("crop: ends must be finite");
  for (int axis = 0; axis < 3; ++axis)
    if (crop->low[axis] > crop->high[axis]) failBadInput("crop: ends are out of order");
}

std::optional<kernel::ClipView> clipView(std::span<const ClipPlane> planes, const std::optional<Crop>& crop,
                                         const Grid& grid, std::span<const int> visible) {
  const glm::dvec3 low(-0.5), high = glm::dvec3(grid.dims) - 0.5;
  const auto kept = crop ? keptBox(*crop, low, high) : Kept{low, high, true};
  if (!kept) return std::nullopt;
  kernel::ClipView view{};
  view.low = glm::vec3(kept->low);
  view.high = glm::vec3(kept->high);
  for (int axis = 0; axis < 3; ++axis) {  // crop regions are half-open; the volume's box is closed
    if (kept->high[axis] < high[axis]) view.high[axis] = std::nextafter(view.high[axis], -1.0f);
    if (!(view.low[axis] < view.high[axis])) return std::nullopt;
  }

  view.parts = !kept->whole;
  view.cropAt[0] = view.cropAt[1] = glm::vec3(kernel::kInfinity);
  for (std::size_t i = 0; i < kernel::kCropRegions; ++i)
    view.regions[i] = kept->whole || (crop->regions >> i & 1) ? ~0u : 0u;
  if (!kept->whole) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto place = [&](double at) {
        return at > low[axis] ? at < high[axis] ? float(at) : kernel::kInfinity : -kernel::kInfinity;
      };
      view.cropAt[0][axis] = place(crop->low[axis]);
      view.cropAt[1][axis] = place(crop->high[axis]);
    }
  }

  const std::uint32_t all = visible.empty() ? 0 : ~0u >> (kernel::kMaxVisibleChannels - visible.size());
  std::vector<kernel::ClipPlaneView> ofSome;
  for (const ClipPlane& plane : planes) {
    std::uint32_t channels = plane.channels ? 0 : all;
    if (plane.channels)
      for (std::size_t n = 0; n < visible.size(); ++n)
        if (std::count(plane.channels->begin(), plane.channels->end(), visible[n]) > 0) channels |= 1u << n;
    if (channels == 0) continue;
    const auto placed = viewOf(plane, grid, channels);
    if (channels == all)
      view.planes[view.wholePlanes++] = placed;
    else
      ofSome.push_back(placed);
  }
  view.planeCount = view.wholePlanes;
  for (const auto& plane : ofSome) view.planes[view.planeCount++] = plane;
  view.parts = view.parts || !ofSome.empty();
  return view;
}

}  // namespace scolopax
