// SPDX-License-Identifier: Apache-2.0
// Instead of the rest of this folder in a build without nvcc.
#include "cuda/cuda_launcher.h"
#include "renderer/core/error.h"

namespace scolopax::cuda {

struct Devices {};

std::vector<DeviceInfo> devices(std::string* why) {
  if (why) *why = "this program was built without CUDA";
  return {};
}

SharedDevices openDevices(const std::vector<int>&, std::function<bool()>) {
  throw Error(ErrorCode::device, "CUDA: this program was built without it");
}

std::unique_ptr<Launcher> makeCudaLauncher(SharedDevices, int, DeviceFailure) { return nullptr; }

}  // namespace scolopax::cuda
