// SPDX-License-Identifier: Apache-2.0
#include "cuda/cuda_launcher.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>

#include "cuda/check.h"
#include "cuda/device.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"

namespace scolopax::cuda {
namespace {

/// Bands at once on each device: one is rendered while the other's pixels are copied.
constexpr int kBandsAtOnce = 2;

/// The rows of a pass that are not done, as runs of neighbouring rows. A row that is done in part is rendered
/// again: it comes out the same.
class RowsLeft {
 public:
  explicit RowsLeft(const Pass& pass) : pass_(pass) {}
  struct Run {
    int first, count;
  };
  /// The next run, of at most `most` rows.
  std::optional<Run> next(int most) {
    while (row_ < pass_.scene.height && done(row_)) ++row_;
    const int first = row_;
    while (row_ < pass_.scene.height && row_ - first < most && !done(row_)) ++row_;
    if (row_ == first) return std::nullopt;
    return Run{first, row_ - first};
  }

 private:
  bool done(int row) const {
    const auto width = std::size_t(pass_.scene.width);
    const std::uint8_t* begin = pass_.done + std::size_t(row) * width;
    return std::find(begin, begin + width, std::uint8_t(0)) == begin + width;
  }
  const Pass& pass_;
  int row_ = 0;
};

class CudaLauncher final : public Launcher {
 public:
  CudaLauncher(SharedDevices devices, int threads, DeviceFailure failure)
      : shared_(std::move(devices)),
        devices_(shared_->all),
        cpu_(makeCpuLauncher(threads)),
        failure_(std::move(failure)),
        scenes_(devices_.size()) {}
  ~CudaLauncher() override { forgetScenes(); }

  std::string_view name() const override { return onCpu() ? "cpu" : "cuda"; }
  void run(const std::function<void()>& f) override { cpu_->run(f); }

  void upload(const std::shared_ptr<const RenderPlan>& plan, const std::stop_token& stop) override {
    unlessFailed([&] {
      inMemory(*plan, [&] {
        for (std::size_t d = 0; d < devices_.size(); ++d)
          if (!sceneOn(d, *plan, [&] { return stop.stop_requested(); }))
            throw Error(ErrorCode::cancelled, "the upload was cancelled");
      });
    });
  }
  bool uploadTakesLong(const RenderPlan& before, const Scene& scene) const override {
    return !onCpu() && std::any_of(devices_.begin(), devices_.end(), [&](const auto& device) {
      const auto& channels = before.scene().channels;
      for (std::size_t i = 0; i < scene.channels.size() && i < channels.size(); ++i)
        if (scene.channels[i].visible && scene.channels[i] != channels[i] &&
            !device->volume(before.volume())->has(int(i)))
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

  static void useQuietly(const Device& device) {
    try {
      device.use();
    } catch (const Error&) {
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
    for (const auto& device : devices_) {
      device->use();
      const std::size_t most = device->capacity(), held = device->heldBytes();
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
    std::vector<std::shared_ptr<const DeviceScene>> scenes(devices_.size());
    {
      const std::lock_guard lock(mutex_);
      scenes.swap(scenes_);
    }
    bool any = false;
    for (std::size_t d = 0; d < devices_.size(); ++d) {
      if (!scenes[d]) continue;
      useQuietly(*devices_[d]);
      scenes[d].reset();
      any = true;
    }
    return any;
  }

  struct Flight {
    std::size_t device;
    std::unique_ptr<Band> band;
  };
  /// Bands under way; gives them back, or releases them if they have not been finished.
  class Flights {
   public:
    explicit Flights(const Devices::List& devices) : devices_(devices) {}
    Flights(const Flights&) = delete;
    Flights& operator=(const Flights&) = delete;
    ~Flights() {
      for (Flight& flight : bands_) {
        useQuietly(*devices_[flight.device]);
        flight.band.reset();
      }
    }
    std::size_t on(std::size_t device) const {
      return std::size_t(
          std::count_if(bands_.begin(), bands_.end(), [&](const Flight& f) { return f.device == device; }));
    }
    bool empty() const { return bands_.empty(); }
    /// A band for a pass; null if the device has no memory for one more.
    std::unique_ptr<Band> take(std::size_t device, const Pass& pass) const {
      try {
        auto band = devices_[device]->takeBand();
        band->prepare(pass.cost, pass.first);
        return band;
      } catch (const Error& error) {
        if (error.code() != ErrorCode::tooLarge || on(device) == 0) throw;
        return nullptr;
      }
    }
    void begin(std::size_t device, std::unique_ptr<Band> band, const Pass& pass,
               const kernel::SceneView& scene, int firstRow, int rows) {
      bands_.push_back({device, std::move(band)});
      bands_.back().band->start(pass, scene, firstRow, rows);
    }
    void finishOldest(const Pass& pass) {
      Flight& flight = bands_.front();
      Device& device = *devices_[flight.device];
      device.use();
      flight.band->finish(pass);
      device.tookMs(flight.band->kernelMs(),
                    std::size_t(flight.band->rows()) * std::size_t(pass.scene.width));
      device.giveBack(std::move(flight.band));
      bands_.pop_front();
    }

   private:
    const Devices::List& devices_;
    std::deque<Flight> bands_;
  };

  bool launchOnDevices(const Pass& pass) {
    std::vector<std::shared_ptr<const DeviceScene>> scenes(devices_.size());
    for (std::size_t d = 0; d < devices_.size(); ++d) {
      scenes[d] = sceneOn(d, *pass.plan, [&] { return bool(*pass.cancel); });
      if (!scenes[d]) return false;
    }
    RowsLeft rows(pass);
    Flights flights(devices_);
    bool more = true, ended = false;
    while (more || !flights.empty()) {
      bool begun = false;
      for (std::size_t d = 0; more && d < devices_.size(); ++d) {
        if (flights.on(d) == kBandsAtOnce) continue;
        Device& device = *devices_[d];
        device.use();
        std::unique_ptr<Band> band = flights.take(d, pass);
        if (!band) continue;
        ended = *pass.cancel || std::chrono::steady_clock::now() >= pass.deadline;
        const auto run = ended ? std::nullopt : rows.next(device.rowsOf(pass.scene.width, pass.scene.height));
        more = run.has_value();
        if (!more) {
          device.giveBack(std::move(band));
          break;
        }
        flights.begin(d, std::move(band), pass, scenes[d]->viewOf(pass.scene), run->first, run->count);
        begun = true;
      }
      if (!begun && !flights.empty()) flights.finishOldest(pass);
    }
    return !ended;
  }

  /// A plan's scene on a device; null if `stop` returned true before its volume was there.
  std::shared_ptr<const DeviceScene> sceneOn(std::size_t d, const RenderPlan& plan,
                                             const std::function<bool()>& stop) {
    Device& device = *devices_[d];
    device.use();
    const std::lock_guard lock(mutex_);
    std::shared_ptr<const DeviceScene>& scene = scenes_[d];
    if (scene && scene->plan().get() == &plan) return scene;
    auto planes = device.volume(plan.volume())->upload(plan.visibleChannels(), stop);
    if (!planes) return nullptr;
    scene = device.makeScene(plan.shared_from_this(), std::move(*planes), scene.get());
    return scene;
  }

  const SharedDevices shared_;
  const Devices::List& devices_;
  const std::unique_ptr<Launcher> cpu_;
  const DeviceFailure failure_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<const DeviceScene>> scenes_;  // per device: the last plan's
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
    found.push_back({index, properties.name, properties.major, properties.minor, total, free});
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
