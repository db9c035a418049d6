// SPDX-License-Identifier: Apache-2.0
// The renderer's interface: takes a volume and a scene and accumulates a picture. Used by the server and the
// commands; implemented by engine/ on top of a launcher, which runs the kernels.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string_view>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/aov.h"
#include "renderer/data/image.h"
#include "renderer/data/pick.h"
#include "renderer/data/rebuild_stats.h"
#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax {

class Launcher;

/// Memory, in bytes, that a renderer's film takes for each pixel, with a volume of so many channels and with
/// AOVs if they are recorded. The corrections of Method::automatic take more where memory is left.
std::size_t filmPixelBytes(std::size_t channels, bool aovs);

/// Counts over all samples since the film was reset, and over the corrections of Method::automatic: all that
/// the picture took, except the choice of the method. Trackers give the same counts on every machine. For
/// quadrature, `fetches` and `cellSteps` depend on how many rays the processor marches at once.
struct RenderStats {
  std::uint64_t rays = 0;           ///< of the samples; those of corrections are not counted
  std::uint64_t fetches = 0;        ///< trilinear samples of one channel
  std::uint64_t cellSteps = 0;      ///< macrocells visited
  std::uint64_t randomBlocks = 0;   ///< random blocks drawn, of up to four numbers each
  std::uint64_t truncatedRays = 0;  ///< stopped at the limit on tentative collisions or segments
};

/// The method and step with which a scene is rendered: its own or, for Method::automatic, those that the
/// renderer chose from the scene and the data.
struct Choice {
  Method method;
  /// As Scene::step; 0 for trackers, which have no step. Method::automatic may also choose parts of voxel
  /// cells, which no scene can ask for: then the longest part.
  double step;
  /// For Method::automatic, the corrections of the film's picture: for each level, the step of the finer of
  /// the two pictures whose difference it is (0: whole voxel cells), and how many passes it has.
  struct Correction {
    double step;
    std::uint32_t passes;
  };
  std::vector<Correction> corrections;
};

/// Before the first setScene() there is no picture: choice(), renderPixels(), addPixels() and pick() need
/// one.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual std::string_view backendName() const = 0;
  /// Sets a new scene and rebuilds what it makes stale. Throws Error(badInput) if the scene is invalid or
  /// does not fit the volume, and Error(cancelled) if `stop` is requested before the work is nearly done.
  /// Either error leaves the renderer unchanged.
  virtual RebuildStats setScene(const Scene& scene, std::stop_token stop = {}) = 0;
  /// Whether setScene would block the caller for longer than a few milliseconds.
  virtual bool takesLong(const Scene& scene) const = 0;
  /// Renders one sample of every pixel. Returns false if `cancel` became true or `budget` ran out; both are
  /// checked every few pixels. The next call resumes where this one stopped, unless a new scene was set in
  /// between. The film does not change until addPixels().
  virtual bool renderPixels(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget = kNoBudget) = 0;
  /// Adds the sample to the film. Call once after renderPixels() has returned true.
  virtual void addPixels() = 0;
  /// Calls renderPixels() and, if it completes, addPixels().
  bool renderSample(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget = kNoBudget) {
    if (!renderPixels(cancel, budget)) return false;
    addPixels();
    return true;
  }
  static constexpr std::chrono::nanoseconds kNoBudget = std::chrono::hours(24 * 365);
  /// Whether addPixels(), image() and aov() block the caller for longer than a few milliseconds.
  virtual bool filmIsLarge() const = 0;
  virtual Choice choice() const = 0;
  /// Samples per pixel in the film.
  virtual std::uint32_t samples() const = 0;
  /// Estimated RMSE of the current picture over linear premultiplied RGBA. Includes noise and, for quadrature
  /// that was chosen automatically or has at least 16 samples, bias. NaN with fewer than two samples, and
  /// where the bias is not known because measuring it would take too much work. Throws Error(cancelled) soon
  /// after `stop` is requested, but only while errorTakesLong() is true.
  virtual double estimatedError(std::stop_token stop = {}) const = 0;
  /// Whether estimatedError() would have to measure the bias, which is slow. Once measured, the bias is kept
  /// until the film is reset.
  virtual bool errorTakesLong() const = 0;
  /// Starts counting costs. Takes a little time and, for each pixel, 16 bytes, with corrections 32. Call
  /// before setScene().
  virtual void countCosts() = 0;
  /// All zero unless costs are counted.
  virtual RenderStats stats() const = 0;
  /// Starts recording the values that aov() returns, and counting the costs of samples, but not those of
  /// corrections. Takes time, and memory for each pixel and channel. Resets the film.
  virtual void recordAovs() = 0;
  /// All values are NaN unless AOVs are recorded.
  virtual AovValues aov(Aov which) const = 0;
  /// Starts a pick, which finds what is visible in an area of the picture by taking samples with the scene's
  /// own method. It does not use the film: the result is the same for the same scene, whatever has been
  /// rendered. `scene` must be the one given to setScene(), but its size, filter, method and step may differ,
  /// as a picture shown for a while may be smaller and coarser. Method::automatic picks as superposed does.
  /// Must not be called during setScene(). The result keeps to the scene that is set now, even if another is
  /// set later, and may be used from any thread, even after the renderer has ended.
  virtual std::unique_ptr<Picking> pick(const Scene& scene, const PixelArea& area) const = 0;
  virtual Image image() const = 0;
};

/// Memory is charged to `memory`, if given; setScene() and recordAovs() then rethrow its errors.
std::unique_ptr<Renderer> makeRenderer(std::unique_ptr<Launcher> launcher,
                                       std::shared_ptr<const Volume> volume,
                                       std::shared_ptr<MemoryBudget> memory = nullptr);
/// Renders on the CPU with `threads` threads; 0 means all of them. The same scene, seed and sample count give
/// the same bits for any number of threads.
std::unique_ptr<Renderer> makeCpuRenderer(std::shared_ptr<const Volume> volume, int threads,
                                          std::shared_ptr<MemoryBudget> memory = nullptr);

}  // namespace scolopax
