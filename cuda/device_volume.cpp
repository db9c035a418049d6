// SPDX-License-Identifier: Apache-2.0
#include "cuda/device_volume.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace scolopax::cuda {

bool DeviceVolume::upload(std::span<const int> channels, const std::function<bool()>& stop) {
  const std::lock_guard lock(mutex_);
  for (const int n : channels) {
    const VoxelView& voxels = volume_->channels()[std::size_t(n)].voxels;
    Plane& plane = channels_[std::size_t(n)];
    if (!plane.memory) {
      const std::size_t bytes = voxels.count() * sizeBytes(voxels.type());
      plane = {memory_.allocate(bytes), 0, bytes};
    }
    visitScalarType(voxels.type(), [&](auto zero) {
      using T = decltype(zero);
      const auto from = voxels.as<T>();
      plane.uploaded = uploader_.copy(
          plane.memory.get(), plane.bytes, plane.uploaded,
          [&](std::byte* piece, std::size_t offset, std::size_t count) {
            T* to = reinterpret_cast<T*>(piece);
            const std::size_t first = offset / sizeof(T);
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count / sizeof(T), 1 << 16),
                              [&](const auto& range) {
                                for (std::size_t i = range.begin(); i < range.end(); ++i)
                                  to[i] = from[first + i];
                              });
          },
          stop);
    });
    if (plane.uploaded < plane.bytes) return false;
  }
  return true;
}

bool DeviceVolume::has(int channel) const {
  const std::lock_guard lock(mutex_);
  const Plane& plane = channels_[std::size_t(channel)];
  return plane.memory && plane.uploaded == plane.bytes;
}

const void* DeviceVolume::voxels(int channel) const {
  const std::lock_guard lock(mutex_);
  return channels_[std::size_t(channel)].memory.get();
}

}  // namespace scolopax::cuda
