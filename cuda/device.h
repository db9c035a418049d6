// SPDX-License-Identifier: Apache-2.0
// CUDA devices as all launchers of the process share them: their memory, the volumes on them, and bands.
#pragma once
#include <atomic>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "cuda/band.h"
#include "cuda/cancel_watch.h"
#include "cuda/device_memory.h"
#include "cuda/device_scene.h"
#include "cuda/device_volume.h"
#include "cuda/uploader.h"

namespace scolopax::cuda {

/// Every function may be called from any thread.
class Device {
 public:
  /// `release`: as for openDevices().
  Device(int index, std::function<bool()> release) : index_(index), release_(std::move(release)) {}
  ~Device();

  /// Makes it the current device of the calling thread, on which the other functions depend.
  void use() const;
  /// The same for what must go on even if the device has failed.
  void tryToUse() const;
  /// The volume on the device, empty at first. What nobody holds of it stays there until memory is short.
  std::shared_ptr<DeviceVolume> volume(const std::shared_ptr<const Volume>& volume);
  std::shared_ptr<const DeviceScene> makeScene(std::shared_ptr<const RenderPlan> plan,
                                               DeviceVolume::Planes planes, const DeviceScene* before) {
    return std::make_shared<const DeviceScene>(std::move(plan), std::move(planes), *memory_, uploader_,
                                               before);
  }
  /// The most bytes that this process could have on the device: those that it has, and those that are free.
  std::size_t capacity() const;
  /// Bytes of the volumes that are rendered.
  std::size_t heldBytes() const;
  std::unique_ptr<Band> takeBand();
  void giveBack(std::unique_ptr<Band> band);

  /// How many rows of a picture to render at once: so few that a pass can end within a few milliseconds.
  int rowsOf(int width, int height) const;
  /// Remembers how long a kernel took.
  void tookMs(float ms, std::size_t pixels);

 private:
  bool makeRoom();
  bool dropUnused();

  const int index_;
  const std::function<bool()> release_;
  const std::shared_ptr<DeviceMemory> memory_ = std::make_shared<DeviceMemory>([this] { return makeRoom(); });
  Uploader uploader_;
  CancelWatch cancelWatch_;
  mutable std::mutex mutex_;
  std::list<std::shared_ptr<DeviceVolume>> volumes_;  // the most recently used first
  std::vector<std::unique_ptr<Band>> bands_;          // those that nobody uses
  std::atomic<float> nsPerPixel_{50};
};

struct Devices {
  using List = std::vector<std::unique_ptr<Device>>;
  List all;
  std::atomic<bool> failed{false};  ///< one of them has failed
};

}  // namespace scolopax::cuda
