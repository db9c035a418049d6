// SPDX-License-Identifier: Apache-2.0
// CUDA devices as all launchers of the process share them: their memory, the volumes on them, and bands.
#pragma once
#include <atomic>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "cuda/band.h"
#include "cuda/device_memory.h"
#include "cuda/device_scene.h"
#include "cuda/device_volume.h"
#include "cuda/uploader.h"

namespace scolopax::cuda {

/// Every function may be called from any thread.
class Device {
 public:
  explicit Device(int index) : index_(index) {}
  ~Device();

  /// Makes it the current device of the calling thread, on which the other functions depend.
  void use() const;
  /// The volume on the device, empty at first. It stays there until memory is short.
  std::shared_ptr<DeviceVolume> volume(const std::shared_ptr<const Volume>& volume);
  std::shared_ptr<const DeviceScene> makeScene(std::shared_ptr<const RenderPlan> plan,
                                               std::shared_ptr<DeviceVolume> volume,
                                               const DeviceScene* before) {
    return std::make_shared<const DeviceScene>(std::move(plan), std::move(volume), *memory_, uploader_,
                                               before);
  }
  std::unique_ptr<Band> takeBand();
  void giveBack(std::unique_ptr<Band> band);

  /// How many rows of a picture to render at once: so few that a pass can end within a few milliseconds.
  int rowsOf(int width, int height) const;
  /// Remembers how long a kernel took.
  void tookMs(float ms, std::size_t pixels);

 private:
  bool makeRoom();

  const int index_;
  const std::shared_ptr<DeviceMemory> memory_ = std::make_shared<DeviceMemory>([this] { return makeRoom(); });
  Uploader uploader_;
  std::mutex mutex_;
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
