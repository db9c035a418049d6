// SPDX-License-Identifier: Apache-2.0
// A volume and a scene in, an accumulating picture out. The server and the commands use this; engine/
// implements it over a launcher, which runs the kernels.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string_view>

#include "renderer/core/memory_budget.h"
#include "renderer/data/aov.h"
#include "renderer/data/image.h"
#include "renderer/data/pick.h"
#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax {

class Launcher;

/// What setScene had to redo.
struct RebuildStats {
  int macrocellChannels = 0;      ///< channels whose macrocells were measured again
  int majorantChannels = 0;       ///< channels whose table of bounds was rebuilt
  std::size_t majorantCells = 0;  ///< macrocells whose majorant was worked out again
  bool filmReset = false;         ///< false: the new scene makes the same picture, samples are kept
  double rebuildMs = 0;           ///< of the plans; where method and step are chosen, of the trial's too
};

/// Counts over all samples since the film was reset. Those of trackers are the same on every machine; of
/// quadrature, fetches and cells depend on how many rays the processor takes at once.
struct RenderStats {
  std::uint64_t rays = 0;
  std::uint64_t fetches = 0;        ///< trilinear samples of one channel
  std::uint64_t cellSteps = 0;      ///< macrocells visited
  std::uint64_t randomBlocks = 0;   ///< draws of up to four numbers
  std::uint64_t truncatedRays = 0;  ///< ended by the bound on null collisions: thicker than can be tracked
};

/// How a scene is rendered: as it says, or for Method::automatic as the backend has chosen from scene and
/// data.
struct Choice {
  Method method;
  double step;  ///< of quadrature, in smallest spacings; 0 for trackers, which have none
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual std::string_view backendName() const = 0;
  /// Takes a new scene and redoes what it makes stale. Throws Error(badInput) for a scene that does not fit,
  /// and Error(cancelled) once `stop` is requested, unless it is nearly done; both leave all as it was.
  virtual RebuildStats setScene(const Scene& scene, std::stop_token stop = {}) = 0;
  /// Whether setScene would keep the caller for longer than a few milliseconds.
  virtual bool takesLong(const Scene& scene) const = 0;
  /// Renders one sample of every pixel. Returns false when `cancel` became true or the budget of time was
  /// used up; both are looked at every few pixels. The next call goes on where this one stopped, unless a new
  /// scene came in between. The film is unchanged until addPixels.
  virtual bool renderPixels(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget = kNoBudget) = 0;
  /// Adds the sample to the film; once, after renderPixels has returned true.
  virtual void addPixels() = 0;
  /// Both of them.
  bool renderSample(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget = kNoBudget) {
    if (!renderPixels(cancel, budget)) return false;
    addPixels();
    return true;
  }
  static constexpr std::chrono::nanoseconds kNoBudget = std::chrono::hours(24 * 365);
  virtual Choice choice() const = 0;
  /// Samples per pixel in the film.
  virtual std::uint32_t samples() const = 0;
  /// Estimated RMSE over linear premultiplied RGBA of the picture as it stands: of noise and, for quadrature
  /// that was chosen automatically or has 16 samples, bias; NaN below two samples.
  /// Throws Error(cancelled) soon after `stop` is requested, but only while errorTakesLong().
  virtual double estimatedError(std::stop_token stop = {}) const = 0;
  /// Whether estimatedError would measure a bias, which takes long; once it has, the bias is known until the
  /// film is reset.
  virtual bool errorTakesLong() const = 0;
  /// From now on, count what samples cost; costs a little time and 16 bytes a pixel. Call before setScene.
  virtual void countCosts() = 0;
  /// All zero unless counting.
  virtual RenderStats stats() const = 0;
  /// From now on, keep what aov() gives, and count costs; takes time, and memory by pixel and channel. The
  /// film begins anew.
  virtual void recordAovs() = 0;
  /// All values not defined unless recording.
  virtual AovValues aov(Aov which) const = 0;
  /// Looks up what is visible in an area of the picture, by the method's own samples, without the film. The
  /// same for the same scene, whatever has been rendered. `scene`: that of setScene, but size, filter, method
  /// and step may differ: what is shown for a while may be smaller and coarser. Automatic looks as superposed
  /// does. Not while setScene runs. What it returns keeps the scene of now, and may be used from any thread
  /// while the renderer lives, also during a later setScene.
  virtual std::unique_ptr<Picking> pick(const Scene& scene, const PixelArea& area) const = 0;
  virtual Image image() const = 0;
};

/// Its memory is charged to `memory`, if given; setScene and recordAovs rethrow its errors.
std::unique_ptr<Renderer> makeRenderer(std::unique_ptr<Launcher> launcher,
                                       std::shared_ptr<const Volume> volume,
                                       std::shared_ptr<MemoryBudget> memory = nullptr);
/// On the processor; `threads` 0 means all. Same scene, seed and sample count give the same bits for any
/// number of threads.
std::unique_ptr<Renderer> makeCpuRenderer(std::shared_ptr<const Volume> volume, int threads,
                                          std::shared_ptr<MemoryBudget> memory = nullptr);

}  // namespace scolopax
