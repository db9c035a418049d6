// SPDX-License-Identifier: Apache-2.0
// A launcher runs kernels on the CPU's threads (cpu/) or on a device. The engine calls it to render passes,
// and does everything above the level of pixels itself.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <glm/vec4.hpp>
#include <memory>
#include <stop_token>
#include <string_view>

#include "renderer/data/render_plan.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax {

/// One sample of every pixel of a picture. `cost` and `first` are as in kernel::RenderPixel, and `pixels` is
/// its `pass`.
struct Pass {
  /// Owns what `scene` points to, and shares it with the plans before and after it. A launcher may keep it
  /// for as long as it needs (shared_from_this).
  const RenderPlan* plan;
  Method method;  ///< automatic renders as superposed
  /// The plan's view; camera, size, resolution, random numbers and lighting may be other than the plan's.
  kernel::SceneView scene;
  kernel::SampleNumber number;
  glm::vec4* pixels;
  kernel::SampleCost* cost = nullptr;       ///< null if costs are not counted
  kernel::FirstCollision* first = nullptr;  ///< null if first collisions are not recorded
  std::uint8_t* done;  ///< width x height: nonzero for the pixels of this pass that are already rendered
  const std::atomic<bool>* cancel;
  std::chrono::steady_clock::time_point deadline;
};

/// Every function may be called from several threads at once.
class Launcher {
 public:
  virtual ~Launcher() = default;
  virtual std::string_view name() const = 0;
  /// Calls f in the launcher's thread arena: parallel loops in f use no other threads. Rethrows what f
  /// throws.
  virtual void run(const std::function<void()>& f) = 0;
  /// Moves a plan to the device, if there is one, so that launching its passes does not have to. Throws
  /// Error(cancelled) once `stop` is requested, and Error(tooLarge).
  virtual void upload(const std::shared_ptr<const RenderPlan>& plan, const std::stop_token& stop) = 0;
  /// Whether uploading a plan of the scene would take longer than a few milliseconds. `before` is a plan of
  /// the same volume that has been uploaded.
  virtual bool uploadTakesLong(const RenderPlan& before, const Scene& scene) const = 0;
  /// Renders the pixels of a pass that are not yet done. Returns false if pixels are left because `cancel`
  /// became true or the deadline passed. Rays end early once `cancel` is true; the deadline is looked at
  /// between rays or, on a device, between bands of rows, so that one that takes longer than a turn is
  /// completed. Runs in the caller's thread arena:
  /// call it from run() to use the launcher's threads.
  virtual bool launch(const Pass& pass) = 0;
};

/// `threads` 0 means all.
std::unique_ptr<Launcher> makeCpuLauncher(int threads);

}  // namespace scolopax
