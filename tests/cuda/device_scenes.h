// SPDX-License-Identifier: Apache-2.0
// Scenes that reach every branch of the kernels.
#pragma once
#include <string>

#include "cuda/cuda_launcher.h"
#include "renderer/renderer.h"
#include "tests/support/volumes.h"

namespace scolopax::test {

/// Three channels of three types, one of them with holes, and a fourth that is hidden.
inline std::shared_ptr<const Volume> mixedVolume() {
  const glm::ivec3 dims(11, 9, 13);
  const auto ball = [](double x, double y, double z, double radius) {
    const double distance = std::sqrt((x - 5) * (x - 5) + (y - 4) * (y - 4) + (z - 6) * (z - 6));
    return std::max(0.0, 1 - distance / radius);
  };
  return volumeOf(
      gridOf(dims, {1, 1.5, 0.75}, {100, -20, 3}),
      channelOf<std::uint8_t>(dims, [&](int x, int y, int z) { return 255 * ball(x, y, z, 7); }),
      channelOf<std::uint16_t>(dims, [&](int x, int y, int z) { return 65535 * ball(x + 2, y, z - 2, 6); }),
      channelOf<float>(dims,
                       [&](int x, int y, int z) {
                         return x == 7 && y == 4 ? std::numeric_limits<double>::quiet_NaN()
                                                 : ball(x - 3, y + 1, z, 6);
                       }),
      channelOf<std::int16_t>(dims, [](int x, int, int) { return 100 * x; }));
}

/// Two channels, one with negative values.
inline std::shared_ptr<const Volume> signedVolume() {
  const glm::ivec3 dims(6, 8, 5);
  return volumeOf(gridOf(dims),
                  channelOf<std::int16_t>(
                      dims, [](int x, int y, int z) { return 1000 * std::sin(x + y * 0.5 + z * 0.3); }),
                  channelOf<std::uint16_t>(dims, [](int x, int y, int z) { return 700 * x + 40 * y * z; }));
}

/// A perspective view, curves with several knots, gamma, three kinds of light.
inline Scene obliqueScene(const Volume& volume, int width, int height) {
  Scene scene;
  scene.width = width;
  scene.height = height;
  scene.seed = 7;
  scene.method = Method::superposed;
  scene.camera = framingCamera(volume.grid(), 40, double(width) / height);
  scene.channels.resize(volume.channels().size());
  const glm::dvec3 colors[] = {{0.9, 0.4, 0.1}, {0.2, 0.8, 0.3}, {0.1, 0.3, 1}};
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    ChannelAppearance& channel = scene.channels[i];
    const Histogram& histogram = volume.channels()[i].histogram;
    channel.rangeLo = histogram.minimum;
    channel.rangeHi = histogram.maximum;
    channel.density = 0.6 + 0.3 * double(i);
    channel.weight = 1 + 0.5 * double(i);
    channel.opacity = {{0.1, 0}, {0.4, 0.7}, {0.4, 0.2}, {1, 1}};
    channel.color = {{0, colors[i % 3]}, {0.6, {1, 1, 1}}, {1, colors[(i + 1) % 3]}};
    channel.visible = i < 3;
  }
  if (scene.channels.size() > 1) scene.channels[1].gamma = 1.7;
  const glm::dvec3 centre(volume.grid().worldFromVoxel * glm::dvec4(glm::dvec3(volume.grid().dims) * 0.5, 1));
  scene.lights.resize(3);
  scene.lights[0].type = LightType::directional;
  scene.lights[0].vector = {1, -2, 0.5};
  scene.lights[1].type = LightType::point;
  scene.lights[1].vector = centre + glm::dvec3(20, 10, -5);
  scene.lights[1].color = {1, 0.5, 0.25};
  scene.lights[2].type = LightType::headlight;
  scene.lights[2].intensity = 0.3;
  return scene;
}

/// A renderer on the CUDA devices of the runtime that the program is linked with. A device's error becomes an
/// error of the renderer.
inline std::unique_ptr<Renderer> makeCudaRenderer(const std::shared_ptr<const Volume>& volume,
                                                  const cuda::SharedDevices& devices) {
  return makeRenderer(cuda::makeCudaLauncher(devices, 1, {.continueOnCpu = false, .log = nullptr}), volume);
}
inline std::unique_ptr<Renderer> makeCudaRenderer(const std::shared_ptr<const Volume>& volume) {
  return makeCudaRenderer(volume, cuda::openDevices({0}));
}

}  // namespace scolopax::test
