// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/scene_checks.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/clip_view.h"
#include "renderer/kernel/views/light_view.h"

namespace scolopax {

void checkImageSize(const Scene& scene) {
  if (scene.width < 1 || scene.height < 1 || scene.width > kMaxImageSide || scene.height > kMaxImageSide)
    failBadInput("image: expected width and height from 1 to " + std::to_string(kMaxImageSide) + ", found " +
                 std::to_string(scene.width) + "x" + std::to_string(scene.height));
}

void checkLight(const Light& light) {
  const double length = glm::length(light.vector);
  if (light.type != LightType::headlight && !std::isfinite(length))
    failBadInput("lights: the length of position and direction must be finite");
  if (light.type == LightType::directional && !(length > 0))
    failBadInput("lights: the direction must not be zero");
  for (const double value : {light.intensity, light.color.x, light.color.y, light.color.z})
    if (!(value >= 0 && std::isfinite(value)))
      failBadInput("lights: colour and intensity must be finite and not negative");
}

void checkStep(double step) {
  if (step != 0 && !(step >= kLeastStep && step <= 100))
    failBadInput("integrator.step: expected 0, or " + shortText(kLeastStep) + " to 100, found " +
                 shortText(step));
}

void checkScene(const Scene& scene, std::size_t channels) {
  if (scene.channels.size() != channels)
    failBadInput("scene: expected " + std::to_string(channels) + " channels, found " +
                 std::to_string(scene.channels.size()));
  checkImageSize(scene);
  if (scene.lights.size() > std::size_t(kernel::kMaxLights))
    failBadInput("lights: expected at most " + std::to_string(kernel::kMaxLights) + ", found " +
                 std::to_string(scene.lights.size()));
  for (const Light& light : scene.lights) checkLight(light);
  checkClipping(scene.clip, scene.crop, channels);
  checkStep(scene.step);
  if (scene.macrocell < 1 || scene.macrocell > kMaxMacrocell)
    failBadInput("integrator.macrocell: expected 1 to " + std::to_string(kMaxMacrocell) + ", found " +
                 std::to_string(scene.macrocell));
}

}  // namespace scolopax
