// SPDX-License-Identifier: Apache-2.0
// A scene's arrays in device memory: a copy of what the view of a render plan points to. Kernels read it.
#pragma once
#include <vector>

#include "cuda/device_buffer.h"
#include "renderer/kernel/views.h"

namespace scolopax::cuda {

class DeviceScene {
 public:
  /// Copies the arrays that `host` points to, except MajorantView::active, which kernels on devices do not
  /// use. Throws Error(tooLarge) if they do not fit into the device's memory.
  explicit DeviceScene(const kernel::SceneView& host);
  /// The same scene with device pointers; valid while this object lives.
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
