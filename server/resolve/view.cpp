// SPDX-License-Identifier: Apache-2.0
#include "protocol/fields.h"
#include "renderer/data/camera.h"
#include "renderer/data/scene_checks.h"
#include "renderer/kernel/views/light_view.h"
#include "server/hex_color.h"
#include "server/resolve/parts.h"

namespace scolopax::server {

static_assert(protocol::kMaxSidePixels == std::uint32_t(kMaxImageSide));
static_assert(protocol::kMaxLightItems == std::size_t(kernel::kMaxLights));

using protocol::ProtocolError;

void resolveImage(const protocol::Scene& scene, Scene& render, std::uint64_t maxPixels) {
  const protocol::ImageSettings& wire = scene.image;
  if (std::uint64_t(wire.width) * wire.height > maxPixels)
    throw ProtocolError(422, "/image",
                        "expected at most " + std::to_string(maxPixels) + " pixels, found " +
                            std::to_string(wire.width) + " x " + std::to_string(wire.height));
  render.width = int(wire.width);
  render.height = int(wire.height);
  render.background = glm::vec3(linearOf(wire.background));
  render.filter = valueOf<PixelFilter>(kPixelFilters, wire.filter);
}

void resolveCamera(protocol::Scene& scene, Scene& render, const Grid& grid, std::span<const glm::vec3> seen) {
  const double aspect = double(scene.image.width) / double(scene.image.height);
  const Camera framing = framingCamera(grid, scene.camera.fovY, aspect, seen);
  protocol::Camera& wire = scene.camera;
  if (!wire.eye) wire.eye = arrayOf(framing.eye);
  if (!wire.target) wire.target = arrayOf(framing.target);
  if (!wire.up) wire.up = arrayOf(framing.up);
  render.camera = {vectorOf(*wire.eye), vectorOf(*wire.target), vectorOf(*wire.up), wire.fovY,
                   wire.orthoHeight};
  refuseAt("/camera", [&] { makeCameraRays(render.camera, grid, 1, 1); });
}

void resolveLights(const protocol::Scene& scene, Scene& render) {
  render.shading = scene.shading;
  render.shadows = scene.shadows;
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const protocol::Light& wire = scene.lights[i];
    Light light{valueOf<LightType>(kLightTypes, wire.type), vectorOf(wire.direction), linearOf(wire.color),
                wire.intensity};
    if (light.type == LightType::directional && light.vector == glm::dvec3(0))
      throw ProtocolError(422, "/lights/" + std::to_string(i) + "/direction",
                          "expected a direction that is not 0");
    if (light.type == LightType::point) light.vector = vectorOf(wire.position);
    refuseAt("/lights/" + std::to_string(i), [&] { checkLight(light); });
    render.lights.push_back(light);
  }
}

}  // namespace scolopax::server
