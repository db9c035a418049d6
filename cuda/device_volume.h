// SPDX-License-Identifier: Apache-2.0
// The voxels of a volume in device memory, shared by everyone who renders it on the device.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "cuda/device_memory.h"
#include "cuda/uploader.h"
#include "renderer/data/volume.h"

namespace scolopax::cuda {

/// Every function may be called from any thread; the device must be the calling thread's current one.
class DeviceVolume {
 public:
  DeviceVolume(std::shared_ptr<const Volume> volume, DeviceMemory& memory, Uploader& uploader)
      : volume_(std::move(volume)),
        memory_(memory),
        uploader_(uploader),
        channels_(volume_->channels().size()) {}

  const std::shared_ptr<const Volume>& volume() const { return volume_; }
  /// Uploads those of the channels that are not on the device yet. Ends early once `stop` returns true, and
  /// continues with the next call. Returns whether all are there. Throws Error(tooLarge).
  bool upload(std::span<const int> channels, const std::function<bool()>& stop);
  /// Whether a channel has been uploaded.
  bool has(int channel) const;
  /// The voxels of an uploaded channel, x fastest. Each channel is stored by itself: neighbouring threads
  /// read neighbouring voxels of one channel.
  const void* voxels(int channel) const;

 private:
  struct Plane {
    DeviceBytes memory;
    std::size_t uploaded = 0, bytes = 0;
  };
  const std::shared_ptr<const Volume> volume_;
  DeviceMemory& memory_;
  Uploader& uploader_;
  mutable std::mutex mutex_;
  std::vector<Plane> channels_;
};

}  // namespace scolopax::cuda
