// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/clipping.h"
#include "protocol/fields.h"
#include "renderer/data/clip_view.h"
#include "server/resolve/parts.h"

namespace scolopax::server {

static_assert(protocol::kMaxClipItems == std::size_t(kernel::kMaxClipPlanes));
static_assert(std::tuple_size_v<decltype(protocol::Crop::regions)> == std::size_t(kernel::kCropRegions));

using protocol::ProtocolError;

void resolveClipping(protocol::Scene& scene, Scene& render, const VolumeFacts& volume) {
  const Grid& grid = volume.grid;
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  for (std::size_t i = 0; i < scene.clip.size(); ++i) {
    protocol::ClipPlane& wire = scene.clip[i];
    if (!wire.point) wire.point = arrayOf(centre);
    ClipPlane plane{vectorOf(*wire.point), vectorOf(wire.normal), {}};
    const std::string pointer = "/clip/" + std::to_string(i);
    if (plane.normal == glm::dvec3(0))
      throw ProtocolError(422, pointer + "/normal", "expected a direction that is not 0");
    if (wire.media) plane.channels.emplace(wire.media->begin(), wire.media->end());
    refuseAt(pointer, [&] { checkClipping({&plane, 1}, std::nullopt, volume.channels.size()); });
    render.clip.push_back(std::move(plane));
  }

  protocol::Crop& wire = scene.crop;
  Crop crop{{}, {}, 0};
  for (std::size_t i = 0; i < wire.regions.size(); ++i) crop.regions |= std::uint32_t(wire.regions[i]) << i;
  bool keepsAll = (crop.regions & Crop::kInnermost) != 0;
  const auto resolveAxis = [&](std::optional<std::array<double, 2>>& ends, int axis, const char* name) {
    if (!ends) ends = {-0.5, grid.dims[axis] - 0.5};
    const auto [low, high] = *ends;
    if (low > high)
      throw ProtocolError(422, std::string("/crop/") + name,
                          "expected two numbers, the second not below the first");
    keepsAll = keepsAll && low <= -0.5 && high >= grid.dims[axis] - 0.5;
    crop.low[axis] = low;
    crop.high[axis] = high;
  };
  resolveAxis(wire.x, 0, "x");
  resolveAxis(wire.y, 1, "y");
  resolveAxis(wire.z, 2, "z");
  if (!keepsAll) render.crop = crop;
}

}  // namespace scolopax::server
