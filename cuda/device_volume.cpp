// SPDX-License-Identifier: Apache-2.0
#include "cuda/device_volume.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace scolopax::cuda {
namespace {

/// How often a thread that waits for another's upload asks whether it should stop.
constexpr std::chrono::milliseconds kAsk{2};

}  // namespace

std::optional<DeviceVolume::Planes> DeviceVolume::upload(std::span<const int> channels,
                                                         const std::function<bool()>& stop) {
  Planes planes;
  for (const int n : channels) {
    planes.push_back(uploadOne(n, stop));
    if (!planes.back()) return std::nullopt;
  }
  return planes;
}

/// Null if `stop` returned true first.
DeviceBytes DeviceVolume::uploadOne(int channel, const std::function<bool()>& stop) {
  Plane& plane = channels_[std::size_t(channel)];
  std::unique_lock lock(mutex_);
  while (plane.busy) {
    lock.unlock();
    if (stop()) return nullptr;
    lock.lock();
    idle_.wait_for(lock, kAsk, [&] { return !plane.busy; });
  }
  if (plane.isUploaded()) return plane.memory;
  plane.busy = true;
  Plane next = plane;
  lock.unlock();
  const auto end = [&] {
    lock.lock();
    next.busy = false;
    plane = next;
    idle_.notify_all();
  };
  try {
    continueUpload(channel, stop, next);
  } catch (...) {
    end();
    throw;
  }
  end();
  return next.isUploaded() ? next.memory : nullptr;
}

void DeviceVolume::continueUpload(int channel, const std::function<bool()>& stop, Plane& plane) {
  const auto volume = volume_.lock();
  const VoxelView& voxels = volume->channels()[std::size_t(channel)].voxels;
  if (!plane.memory) {
    const std::size_t bytes = voxels.count() * sizeBytes(voxels.type());
    plane.memory = memory_.allocate(bytes);
    plane.bytes = bytes;
    plane.uploaded = 0;
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
}

bool DeviceVolume::has(int channel) const {
  const std::lock_guard lock(mutex_);
  return channels_[std::size_t(channel)].isUploaded();
}

std::size_t DeviceVolume::heldBytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const Plane& plane : channels_)
    if (plane.memory && !plane.isUnused()) bytes += plane.bytes;
  return bytes;
}

bool DeviceVolume::dropUnused() {
  DeviceBytes dropped;  // freed without the mutex, because that waits for the device
  const std::lock_guard lock(mutex_);
  const auto unused =
      std::find_if(channels_.begin(), channels_.end(), [](const Plane& plane) { return plane.isUnused(); });
  if (unused == channels_.end()) return false;
  dropped = std::exchange(*unused, {}).memory;
  return true;
}

bool DeviceVolume::isEmpty() const {
  const std::lock_guard lock(mutex_);
  return std::none_of(channels_.begin(), channels_.end(),
                      [](const Plane& plane) { return plane.memory || plane.busy; });
}

}  // namespace scolopax::cuda
