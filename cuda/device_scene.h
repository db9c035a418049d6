// SPDX-License-Identifier: Apache-2.0
// A scene's arrays in device memory: what a render plan's view points to, uploaded. Kernels read it.
#pragma once
#include <vector>

#include "cuda/device_buffer.h"
#include "renderer/kernel/views.h"

namespace scolopax::cuda {

class DeviceScene {
 public:
  /// Copies everything that `host` points to. Throws Error(tooLarge) when it does not fit the device.
  explicit DeviceScene(const kernel::SceneView& host);
  /// The same scene with pointers of the device; valid as long as this object.
  const kernel::SceneView& view() const { return view_; }

 private:
  template <class T>
  void moveToDevice(const T** array, std::size_t count);
  template <class Value>
  void moveToDevice(kernel::CurveView<Value>* curve);
  void moveToDevice(kernel::OpticalCurveView* curve);

  kernel::SceneView view_;
  std::vector<DeviceBuffer<std::byte>> buffers_;
};

}  // namespace scolopax::cuda
