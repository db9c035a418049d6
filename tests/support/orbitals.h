// SPDX-License-Identifier: Apache-2.0
// Three small orbitals in red, green and blue.
#pragma once
#include "renderer/generate/orbitals.h"
#include "tests/support/volumes.h"

namespace scolopax::test {

inline std::shared_ptr<const Volume> orbitals() {
  GeneratedVolume generated = generateOrbitals(24, 3);
  return std::make_shared<const Volume>(generated.grid, std::move(generated.channels));
}

inline Scene orbitalScene(const Volume& volume) {
  Scene scene;
  scene.width = 50;  // neither side is a multiple of the tile
  scene.height = 37;
  scene.camera = framingCamera(volume.grid(), 35, 50.0 / 37.0);
  scene.channels.resize(volume.channels().size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    scene.channels[i].rangeHi = volume.channels()[i].histogram.maximum;
    scene.channels[i].density = 0.5;
    scene.channels[i].color = {{0, glm::dvec3(i == 0, i == 1, i == 2)}};
  }
  return scene;
}

}  // namespace scolopax::test
