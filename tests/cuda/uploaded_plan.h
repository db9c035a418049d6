// SPDX-License-Identifier: Apache-2.0
// A plan on device 0, for tests that launch kernels themselves.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "cuda/check.h"
#include "cuda/device_scene.h"
#include "cuda/launch.h"
#include "renderer/data/sampling.h"

namespace scolopax::test {

/// Pixels in device memory of exactly their size, so that an access beyond them is detected.
class ExactPixels {
 public:
  explicit ExactPixels(std::size_t count) {
    void* memory = nullptr;
    cuda::check(cudaMalloc(&memory, count * sizeof(glm::vec4)), "allocating device memory");
    data_ = static_cast<glm::vec4*>(memory);
  }
  ExactPixels(const ExactPixels&) = delete;
  ExactPixels& operator=(const ExactPixels&) = delete;
  ~ExactPixels() { cudaFree(data_); }
  glm::vec4* data() const { return data_; }
  void copyTo(std::span<glm::vec4> host) const {
    cuda::check(cudaMemcpy(host.data(), data_, host.size_bytes(), cudaMemcpyDeviceToHost),
                "copying from the device");
  }

 private:
  glm::vec4* data_ = nullptr;
};

class UploadedPlan {
 public:
  UploadedPlan(const std::shared_ptr<const Volume>& volume, const Scene& scene)
      : plan_(std::make_shared<const RenderPlan>(volume, scene)) {
    cuda::DeviceVolume onDevice(volume, *memory_, uploader_);
    auto planes = onDevice.upload(plan_->visibleChannels(), [] { return false; });
    scene_.emplace(plan_, std::move(*planes), *memory_, uploader_);
  }
  const RenderPlan& plan() const { return *plan_; }
  /// Renders the first sample of the whole picture.
  cuda::DeviceBand band(glm::vec4* pixels) const {
    return {.scene = scene_->viewOf(plan_->view()),
            .number = sampleNumber(plan_->scene().sampling, 0),
            .firstRow = 0,
            .rows = plan_->scene().height,
            .pixels = pixels};
  }

 private:
  const std::shared_ptr<cuda::DeviceMemory> memory_ =
      std::make_shared<cuda::DeviceMemory>([] { return false; });
  cuda::Uploader uploader_;
  const std::shared_ptr<const RenderPlan> plan_;
  std::optional<cuda::DeviceScene> scene_;
};

}  // namespace scolopax::test
