// SPDX-License-Identifier: Apache-2.0
#include "cuda/device_scene.h"

namespace scolopax::cuda {

template <class T>
void DeviceScene::moveToDevice(const T** array, std::size_t count) {
  buffers_.emplace_back(std::as_bytes(std::span(*array, count)));
  *array = reinterpret_cast<const T*>(buffers_.back().data());
}

template <class Value>
void DeviceScene::moveToDevice(kernel::CurveView<Value>* curve) {
  moveToDevice(&curve->positions, std::size_t(curve->count));
  moveToDevice(&curve->values, std::size_t(curve->count));
  moveToDevice(&curve->buckets, std::size_t(kernel::kCurveBuckets + 1));
}

void DeviceScene::moveToDevice(kernel::OpticalCurveView* curve) {
  moveToDevice(&curve->knots, std::size_t(curve->count));
  moveToDevice(&curve->buckets, std::size_t(kernel::kCurveBuckets + 1));
}

DeviceScene::DeviceScene(const kernel::SceneView& host) : view_(host) {
  const glm::ivec3 dims = host.dims, cells = host.majorants.cells;
  const std::size_t voxels = std::size_t(dims.x) * std::size_t(dims.y) * std::size_t(dims.z);
  std::vector<kernel::ChannelView> channels(host.channels, host.channels + host.channelCount);
  for (int n = 0; n < host.channelCount; ++n) {
    kernel::ChannelView& channel = channels[std::size_t(n)];
    // Each channel is stored by itself: neighbouring threads read neighbouring voxels of one channel.
    visitScalarType(channel.field.type, [&](auto zero) {
      using T = decltype(zero);
      const T* mixed = static_cast<const T*>(channel.field.voxels) + channel.field.lane;
      std::vector<T> plane(voxels);
      for (std::size_t i = 0; i < voxels; ++i) plane[i] = mixed[i * std::size_t(channel.field.stride)];
      const T* moved = plane.data();
      moveToDevice(&moved, voxels);
      channel.field.voxels = moved;
    });
    channel.field.lane = 0;
    channel.field.stride = 1;
    moveToDevice(&channel.opacity);
    moveToDevice(&channel.color);
    moveToDevice(&channel.optical);
    if (!host.hasFactor(n)) continue;
    moveToDevice(&channel.factor.curve);
    moveToDevice(&channel.factor.optical);
  }
  view_.channels = channels.data();
  moveToDevice(&view_.channels, channels.size());
  kernel::MajorantView& majorants = view_.majorants;
  const std::size_t cellCount = std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z);
  moveToDevice(&majorants.totals, cellCount);
  moveToDevice(&majorants.intervals, cellCount * std::size_t(majorants.columns));
  moveToDevice(&majorants.tables, std::size_t(host.channelCount));
}

}  // namespace scolopax::cuda
