// SPDX-License-Identifier: Apache-2.0
// What runs kernels: the processor's threads (cpu/) or a device. The engine asks one for passes; everything
// above pixels is the engine's.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <glm/vec4.hpp>
#include <memory>
#include <string_view>

#include "renderer/data/scene.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// One sample of every pixel of a picture; pixels, cost and first as in kernel::RenderPixel.
struct Pass {
  kernel::SceneView scene;
  kernel::SampleNumber number;
  glm::vec4* pixels;
  kernel::SampleCost* cost;
  kernel::FirstCollision* first;
  std::uint8_t* done;  ///< width x height: pixels of this pass that are rendered; the others are still to do
  const std::atomic<bool>* cancel;
  std::chrono::steady_clock::time_point deadline;
};

/// Every function may be called from several threads at once.
class Launcher {
 public:
  virtual ~Launcher() = default;
  virtual std::string_view name() const = 0;
  /// Calls f with the threads that are the launcher's: parallel loops in it take no others. Rethrows what it
  /// throws.
  virtual void run(const std::function<void()>& f) = 0;
  /// Renders what is still to do of a pass, with the method, blend mode and light of `scene`, whose method is
  /// not automatic. Returns false when something is left, because `cancel` became true or the deadline
  /// passed; both are looked at every few pixels. Takes the caller's threads: see run().
  virtual bool launch(const Scene& scene, const Pass& pass) = 0;
};

/// `threads` 0 means all.
std::unique_ptr<Launcher> makeCpuLauncher(int threads);

}  // namespace scolopax
