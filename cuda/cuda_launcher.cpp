// SPDX-License-Identifier: Apache-2.0
#include "cuda/cuda_launcher.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "cuda/check.h"
#include "cuda/device.h"
#include "cuda/flights.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"

namespace scolopax::cuda {
namespace {

/// Bands at once on each device: one is rendered while the other's pixels are copied.
constexpr int kBandsAtOnce = 2;

class CudaLauncher final : public Launcher {
 public:
  CudaLauncher(SharedDevices devices, int threads, DeviceFailure failure)
      : shared_(std::move(devices)), cpu_(makeCpuLauncher(threads)), failure_(std::move(failure)) {
    for (const auto& device : shared_->all) targets_.push_back({.device = *device, .scene = nullptr});
  }
  ~CudaLauncher() override { forgetScenes(); }

  std::string_view name() const override { return onCpu() ? "cpu" : "cuda"; }
  void run(const std::function<void()>& f) override { cpu_->run(f); }

  void upload(const std::shared_ptr<const RenderPlan>& plan, const std::stop_token& stop) override {
    unlessFailed([&] {
      inMemory(*plan, [&] {
        for (Target& target : targets_)
          if (!sceneOn(target, *plan, [&] { return stop.stop_requested(); }))
            throw Error(ErrorCode::cancelled, "the upload was cancelled");
      });
    });
  }
  bool uploadTakesLong(const RenderPlan& before, const Scene& scene) const override {
    return !onCpu() && std::any_of(targets_.begin(), targets_.end(), [&](const Target& target) {
      const auto& channels = before.scene().channels;
      for (std::size_t i = 0; i < scene.channels.size() && i < channels.size(); ++i)
        if (scene.channels[i].visible && scene.channels[i] != channels[i] &&
            !target.device.volume(before.volume())->has(int(i)))
          return true;
      return false;
    });
  }

  bool launch(const Pass& pass) override {
    bool complete = false;
    const auto render = [&] { inMemory(*pass.plan, [&] { complete = launchOnDevices(pass); }); };
    return unlessFailed(render) ? complete : cpu_->launch(pass);
  }

 private:
  /// A device, and a plan's scene on it.
  struct Target {
    Device& device;
    std::shared_ptr<const DeviceScene> scene;
  };

  bool onCpu() const { return shared_->failed && failure_.continueOnCpu; }
  /// Calls f(), unless a device has failed or fails now and rendering goes on on the CPU: then returns false.
  template <class F>
  bool unlessFailed(F&& f) {
    if (onCpu()) return false;
    try {
      f();
      return true;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::device) throw;
      const bool known = shared_->failed.exchange(true);
      if (!failure_.continueOnCpu) throw;
      if (!known && failure_.log) failure_.log(std::string(error.what()) + "; rendering goes on on the CPU");
      return false;
    }
  }

  /// Calls f(). If that needs more memory than there is, calls it again without the scene before, whose
  /// channels the next one may not show. Throws Error(tooLarge) and, if others hold the memory, Error(busy).
  template <class F>
  void inMemory(const RenderPlan& plan, F&& f) {
    for (bool again = true;; again = false) {
      try {
        f();
        return;
      } catch (const Error& error) {
        if (error.code() != ErrorCode::tooLarge) throw;
        const bool forgot = forgetScenes();
        if (!again || !forgot) throw lackOfMemory(plan, error);
      }
    }
  }
  /// To be called when the launcher holds no memory itself.
  Error lackOfMemory(const RenderPlan& plan, const Error& error) const {
    std::size_t needed = 0;
    for (const int n : plan.visibleChannels()) {
      const VoxelView& voxels = plan.volume()->channels()[std::size_t(n)].voxels;
      needed += voxels.count() * sizeBytes(voxels.type());
    }
    std::optional<Error> busy;
    for (const Target& target : targets_) {
      target.device.use();
      const std::size_t most = target.device.capacity(), held = target.device.heldBytes();
      const auto textOf = [&](const std::string& use) {
        return "memory of a CUDA device: expected at most " + mebibytes(most) + use + ", found " +
               mebibytes(needed);
      };
      if (needed > most) return Error(ErrorCode::tooLarge, textOf(""));
      if (held > 0) busy.emplace(ErrorCode::busy, textOf(", of which " + mebibytes(held) + " are in use"));
    }
    return busy.value_or(error);
  }
  /// Returns whether there were any.
  bool forgetScenes() {
    bool any = false;
    for (Target& target : targets_) {
      std::shared_ptr<const DeviceScene> scene;
      {
        const std::lock_guard lock(mutex_);
        scene.swap(target.scene);
      }
      if (!scene) continue;
      target.device.tryToUse();
      scene.reset();
      any = true;
    }
    return any;
  }

  bool launchOnDevices(const Pass& pass) {
    std::vector<Target> targets;
    for (Target& target : targets_) {
      auto scene = sceneOn(target, *pass.plan, [&] { return bool(*pass.cancel); });
      if (!scene) return false;
      targets.push_back({.device = target.device, .scene = std::move(scene)});
    }
    RowsLeft rows(pass);
    Flights flights(pass);
    bool more = true, ended = false;
    while (more || !flights.empty()) {
      bool begun = false;
      for (const Target& target : targets) {
        if (!more) break;
        Device& device = target.device;
        if (flights.on(device) == kBandsAtOnce) continue;
        device.use();
        std::unique_ptr<Band> band = flights.take(device);
        if (!band) continue;
        ended = *pass.cancel || std::chrono::steady_clock::now() >= pass.deadline;
        const auto run = ended ? std::nullopt : rows.next(device.rowsOf(pass.scene.width, pass.scene.height));
        more = run.has_value();
        if (!more) {
          device.giveBack(std::move(band));
          break;
        }
        flights.begin(device, std::move(band), target.scene->viewOf(pass.scene), *run);
        begun = true;
      }
      if (begun || flights.empty()) continue;
      if (!flights.finishOldest()) {
        ended = true;
        more = false;
      }
    }
    return !ended;
  }

  /// A plan's scene on a device; null if `stop` returned true before its volume was there.
  std::shared_ptr<const DeviceScene> sceneOn(Target& target, const RenderPlan& plan,
                                             const std::function<bool()>& stop) {
    target.device.use();
    const std::lock_guard lock(mutex_);
    std::shared_ptr<const DeviceScene>& scene = target.scene;
    if (scene && scene->plan().get() == &plan) return scene;
    auto planes = target.device.volume(plan.volume())->upload(plan.visibleChannels(), stop);
    if (!planes) return nullptr;
    scene = target.device.makeScene(plan.shared_from_this(), std::move(*planes), scene.get());
    return scene;
  }

  const SharedDevices shared_;
  const std::unique_ptr<Launcher> cpu_;
  const DeviceFailure failure_;
  std::mutex mutex_;             // of the scenes
  std::vector<Target> targets_;  // with the last plan's scenes
};

}  // namespace

std::vector<DeviceInfo> devices(std::string* why) {
  int count = 0;  // a failing call leaves it unchanged
  const cudaError_t result = cudaGetDeviceCount(&count);
  if (result != cudaSuccess) {
    cudaGetLastError();
    if (why) *why = cudaGetErrorString(result);
    return {};
  }
  std::vector<DeviceInfo> found;
  for (int index = 0; index < count; ++index) {
    cudaDeviceProp properties{};
    std::size_t free = 0, total = 0;
    if (cudaSetDevice(index) != cudaSuccess || cudaGetDeviceProperties(&properties, index) != cudaSuccess ||
        cudaMemGetInfo(&free, &total) != cudaSuccess) {
      cudaGetLastError();
      continue;
    }
    found.push_back({.index = index,
                     .name = properties.name,
                     .major = properties.major,
                     .minor = properties.minor,
                     .memoryBytes = total,
                     .freeBytes = free});
  }
  if (found.empty() && why) *why = "no device";
  return found;
}

SharedDevices openDevices(const std::vector<int>& indexes, std::function<bool()> release) {
  const auto devices = std::make_shared<Devices>();
  for (const int index : indexes) {
    devices->all.push_back(std::make_unique<Device>(index, release));
    devices->all.back()->use();
  }
  return devices;
}

std::unique_ptr<Launcher> makeCudaLauncher(SharedDevices devices, int threads, DeviceFailure failure) {
  return std::make_unique<CudaLauncher>(std::move(devices), threads, std::move(failure));
}

}  // namespace scolopax::cuda
