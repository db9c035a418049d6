// SPDX-License-Identifier: Apache-2.0
// What the view of a render plan points to, in device memory. Kernels read it.
#pragma once
#include <cstddef>
#include <memory>
#include <vector>

#include "cuda/device_memory.h"
#include "cuda/device_volume.h"
#include "renderer/data/render_plan.h"

namespace scolopax::cuda {

class DeviceScene {
 public:
  /// Uploads what `before`, if given, does not already hold: an edit moves what it changes. `planes`: of the
  /// visible channels; the scene holds them, and no others. `memory` and `uploader` must be those of the
  /// device. Throws Error(tooLarge).
  DeviceScene(std::shared_ptr<const RenderPlan> plan, DeviceVolume::Planes planes, DeviceMemory& memory,
              Uploader& uploader, const DeviceScene* before = nullptr);
  const std::shared_ptr<const RenderPlan>& plan() const { return plan_; }
  /// `host`, a view of the plan with other values than its own, with device pointers. They are valid while
  /// this object lives.
  kernel::SceneView viewOf(const kernel::SceneView& host) const;

 private:
  /// An array of the plan, which keeps the host's copy alive.
  struct Array {
    const void* host;
    std::size_t bytes;
    std::byte* device;
    DeviceBytes memory;  // that contains it
  };
  class Upload;

  const std::shared_ptr<const RenderPlan> plan_;
  const DeviceVolume::Planes planes_;
  std::vector<Array> arrays_;
  DeviceBytes channels_;  // kernel::ChannelView, of this plan alone
  DeviceBytes totals_,
      surfaceTotals_;  // computed on the device; shared with the plan before if it has the same
  kernel::SceneView view_;
};

}  // namespace scolopax::cuda
