// SPDX-License-Identifier: Apache-2.0
// The voxels of a volume in device memory, shared by everyone who renders it on the device.
#pragma once
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "cuda/device_memory.h"
#include "cuda/uploader.h"
#include "renderer/data/volume.h"

namespace scolopax::cuda {

/// Keeps the voxels of every channel that has been uploaded, until memory is short. No function except
/// upload() waits for an upload. Every function may be called from any thread; the device must be the calling
/// thread's current one.
class DeviceVolume {
 public:
  /// The voxels of channels, each by itself, x fastest: neighbouring threads read neighbouring voxels of one
  /// channel. They stay on the device while somebody holds them.
  using Planes = std::vector<DeviceBytes>;

  /// Does not keep the volume in memory.
  DeviceVolume(const std::shared_ptr<const Volume>& volume, DeviceMemory& memory, Uploader& uploader)
      : volume_(volume), memory_(memory), uploader_(uploader), channels_(volume->channels().size()) {}

  /// Null once nobody holds it any more.
  std::shared_ptr<const Volume> volume() const { return volume_.lock(); }
  /// The volume must be held by somebody. Uploads those of the channels that are not on the device yet, and
  /// returns the voxels of all of them, in this order. Ends early once `stop` returns true, and returns
  /// nothing; the next call continues there. Throws Error(tooLarge).
  std::optional<Planes> upload(std::span<const int> channels, const std::function<bool()>& stop);
  /// Whether a channel has been uploaded.
  bool has(int channel) const;
  /// Bytes of the channels that somebody holds.
  std::size_t heldBytes() const;
  /// Gives back the memory of a channel that nobody holds; false if there is none.
  bool dropUnused();
  bool isEmpty() const;

 private:
  struct Plane {
    DeviceBytes memory;
    std::size_t uploaded = 0, bytes = 0;
    bool busy = false;  // a thread uploads it, with a copy of this struct
    bool isUploaded() const { return memory && uploaded == bytes; }
    bool isUnused() const { return memory && memory.use_count() == 1; }
  };
  DeviceBytes uploadOne(int channel, const std::function<bool()>& stop);
  void continueUpload(int channel, const std::function<bool()>& stop, Plane& plane);

  const std::weak_ptr<const Volume> volume_;
  DeviceMemory& memory_;
  Uploader& uploader_;
  mutable std::mutex mutex_;      // never held for long: not while copying, allocating or freeing
  std::condition_variable idle_;  // notified when a plane is no longer busy
  std::vector<Plane> channels_;
};

}  // namespace scolopax::cuda
