// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/scene_view.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "renderer/data/resolution.h"

namespace scolopax {
namespace {

static_assert(int(LightType::directional) == int(kernel::LightKind::directional) &&
              int(LightType::point) == int(kernel::LightKind::point) &&
              int(LightType::headlight) == int(kernel::LightKind::headlight));

/// Whether lights or shadows change what a channel looks like.
bool respondsToLight(const Scene& scene, const ChannelAppearance& channel) {
  const Material& m = channel.material;
  return channel.visible &&
         ((scene.shadows && m.ambient != 1) || (scene.shading && (m.diffuse > 0 || m.specular > 0)));
}

/// Moves a very distant point light nearer, so that the squares of its distance fit in a float. It is so far
/// away that its direction is the same for the whole box.
glm::dvec3 withinReach(const glm::dvec3& voxel, const Grid& grid) {
  constexpr double kFarthest = 1e12;
  const glm::dvec3 centre = glm::dvec3(grid.dims - 1) * 0.5, way = voxel - centre;
  const double distance = glm::length(way);
  return distance > kFarthest ? centre + way * (kFarthest / distance) : voxel;
}

void setGrid(kernel::SceneView& view, const Grid& grid) {
  const double smallest = grid.smallestSpacing();
  view.dims = grid.dims;
  view.worldFromVoxel = glm::mat3(glm::dmat3(grid.worldFromVoxel) / smallest);
  view.gradientFromVoxel = glm::mat3(grid.gradientFromVoxel());
  view.smallestSpacing = float(smallest);
}

/// Sets the lights, in voxel space: those that shine, if any channel responds to light.
void setLights(kernel::SceneView& view, const Scene& scene, const Grid& grid) {
  view.shading = scene.shading;
  view.shadows = scene.shadows;
  view.lightCount = 0;
  if (std::none_of(scene.channels.begin(), scene.channels.end(),
                   [&](const ChannelAppearance& channel) { return respondsToLight(scene, channel); }))
    return;
  const std::vector<Light> headlight(1);
  const glm::dmat4 voxelFromWorld = glm::inverse(grid.worldFromVoxel);
  for (const Light& light : scene.lights.empty() ? headlight : scene.lights) {
    // A light without intensity affects neither the shading nor the share of light in shadow.
    if (light.color * light.intensity == glm::dvec3(0)) continue;
    kernel::LightView& v = view.lights[view.lightCount++];
    v.kind = kernel::LightKind(light.type);
    v.intensity = glm::vec3(light.color * light.intensity);
    if (light.type == LightType::point)
      v.vector = glm::vec3(withinReach(glm::dvec3(voxelFromWorld * glm::dvec4(light.vector, 1)), grid));
    else
      v.vector = glm::vec3(glm::dmat3(voxelFromWorld) * -glm::normalize(light.vector));
  }
}

void setChannels(kernel::SceneView& view, std::span<const kernel::ChannelView> channels) {
  view.channelCount = int(channels.size());
  view.channels = channels.data();
  view.nearest = std::any_of(channels.begin(), channels.end(), [](const kernel::ChannelView& channel) {
    return channel.field.filter == kernel::Filter::nearest;
  });
}

}  // namespace

float stratumOf(Method method) { return method == Method::hybrid ? 1.0f / 8.0f : 1.0f / 64.0f; }

kernel::SceneView sceneView(const Scene& scene, const Grid& grid, const kernel::CameraRays& rays,
                            const std::optional<kernel::ClipView>& clip,
                            std::span<const kernel::ChannelView> channels) {
  kernel::SceneView view{};
  setGrid(view, grid);
  setLights(view, scene, grid);
  setChannels(view, channels);
  view.clip = clip.value_or(kernel::ClipView{});
  if (!clip) view.channelCount = 0;
  view.rays = rays;
  view.width = scene.width;
  view.height = scene.height;
  view.seed = scene.seed;
  view.filterWidth = scene.filter == PixelFilter::box ? 1.0f : 0.0f;
  view.stratum = stratumOf(scene.method);
  setResolution(view, resolutionOf(scene));
  return view;
}

}  // namespace scolopax
