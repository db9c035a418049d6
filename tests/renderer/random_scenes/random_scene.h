// SPDX-License-Identifier: Apache-2.0
// A random scene in the form in which clients send it, so that it can be printed and sent again, and the
// resolved scene that the server makes of it.
#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "renderer/data/scene.h"
#include "tests/renderer/random_scenes/random_volume.h"

namespace scolopax::random_scenes {

struct RandomScene {
  std::uint64_t number;
  VolumeSource source;
  std::shared_ptr<const Volume> volume;
  nlohmann::json wire;
  Scene scene;  ///< `wire`, resolved
};

/// Scene `number`: the same on every machine. Fields added later do not change the others.
RandomScene drawScene(std::uint64_t number);
/// One line with the properties of the scene that are most likely to matter.
std::string describe(const RandomScene& scene);
/// Writes scene.json and the volume's files to `folder`; returns the command that renders it.
std::string writeScene(const RandomScene& scene, const std::string& folder);

}  // namespace scolopax::random_scenes
