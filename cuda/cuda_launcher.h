// SPDX-License-Identifier: Apache-2.0
// Renders on CUDA devices. What a program needs to know of this folder is here; in a build without nvcc there
// are no devices.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "renderer/launcher.h"

namespace scolopax::cuda {

struct DeviceInfo {
  int index;
  std::string name;
  int major, minor;  ///< compute capability
  std::uint64_t memoryBytes, freeBytes;
};

/// The usable devices. None without a driver, with a driver that is too old, or after any other error; `why`,
/// if given, then says so in a few words.
std::vector<DeviceInfo> devices(std::string* why = nullptr);

struct Devices;
/// Devices that all launchers of a program share. A failure is shared, too, because a device that has failed
/// works for nobody in the process.
using SharedDevices = std::shared_ptr<Devices>;
/// Before a launcher refuses a scene because others hold a device's memory, it calls `release`, if given, on
/// any thread and with no lock held that another launcher needs. If it returns true, it has released some
/// launcher, and the memory is looked for again. Throws Error(device) if one of the devices cannot be used.
SharedDevices openDevices(const std::vector<int>& indexes, std::function<bool()> release = nullptr);

/// What launchers do once a device has failed.
struct DeviceFailure {
  bool continueOnCpu = true;  ///< otherwise Error(device) is thrown, at every launch
  std::function<void(const std::string&)>
      log;  ///< receives one line in all: that the CPU takes over, and why
};

/// Bands of a picture's rows go to whichever of the devices is free. `threads`: of the CPU, for everything
/// but kernels; 0 means all.
std::unique_ptr<Launcher> makeCudaLauncher(SharedDevices devices, int threads, DeviceFailure failure = {});

}  // namespace scolopax::cuda
