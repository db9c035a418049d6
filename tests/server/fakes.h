// SPDX-License-Identifier: Apache-2.0
// A clock, a renderer and a viewer that tests hold in their hands: nothing here waits or measures time.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "renderer/core/error.h"
#include "server/progressive_render.h"
#include "server/render_loop.h"

namespace scolopax::server::testing {

/// Stands still until it is moved.
class FakeClock {
 public:
  void advance(std::chrono::microseconds by) { microseconds_ += by.count(); }
  Now now() {
    return
        [this] { return TimePoint(std::chrono::seconds(1000) + std::chrono::microseconds(microseconds_)); };
  }

 private:
  std::atomic<long long> microseconds_{0};
};

/// What a test does to, and learns from, every fake renderer it hands out.
struct FakeControl {
  FakeClock* clock = nullptr;
  double secondsPerPixel = 0;        ///< the clock moves so far in a pass
  std::function<void()> duringPass;  ///< called in the middle of each pass
  std::function<double(std::uint32_t samples)> error = [](std::uint32_t) { return 1.0; };
  std::string failure;                     ///< setScene throws it
  int incompletePasses = 0;                ///< calls that use up their budget before the pass is complete
  std::vector<std::uint32_t> passes;       ///< the seed of the scene of each pass that was not cancelled
  std::vector<std::pair<int, int>> sizes;  ///< of each such pass
  int renderersMade = 0;
};

/// Its picture tells which scenes its samples were of: red is the seed when it was one scene, else -1.
class FakeRenderer : public Renderer {
 public:
  explicit FakeRenderer(std::shared_ptr<FakeControl> control) : control_(std::move(control)) {}
  std::string_view backendName() const override { return "fake"; }
  RebuildStats setScene(const Scene& scene) override {
    if (!control_->failure.empty()) throw Error(ErrorCode::badInput, control_->failure);
    RebuildStats stats;
    stats.filmReset = samples_ == 0 || scene.seed != scene_.seed || scene.width != scene_.width ||
                      scene.height != scene_.height;
    if (stats.filmReset) samples_ = 0;
    scene_ = scene;
    return stats;
  }
  bool renderSample(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    if (control_->incompletePasses > 0) {
      if (control_->clock)
        control_->clock->advance(std::chrono::duration_cast<std::chrono::microseconds>(budget));
      return --control_->incompletePasses, false;
    }
    const auto pixels = double(scene_.width) * scene_.height;
    if (control_->clock)
      control_->clock->advance(
          std::chrono::microseconds((long long)(pixels * control_->secondsPerPixel * 1e6)));
    // A copy: it may replace itself.
    if (const auto during = control_->duringPass) during();
    if (cancel) return false;
    seen_ = samples_ == 0 || seen_ == double(scene_.seed) ? double(scene_.seed) : -1;
    ++samples_;
    control_->passes.push_back(scene_.seed);
    control_->sizes.emplace_back(scene_.width, scene_.height);
    return true;
  }
  Choice choice() const override { return {scene_.method, scene_.step}; }
  std::uint32_t samples() const override { return samples_; }
  double estimatedError() const override { return control_->error(samples_); }
  void countCosts() override {}
  RenderStats stats() const override { return {}; }
  void recordAovs() override { samples_ = 0; }
  AovValues aov(Aov which) const override { return {which, 1, 1, {float(samples_)}}; }
  Image image() const override {
    Image image{scene_.width, scene_.height, {}};
    image.pixels.assign(std::size_t(scene_.width) * std::size_t(scene_.height),
                        glm::vec4(float(seen_), float(samples_), 0, 1));
    return image;
  }

 private:
  const std::shared_ptr<FakeControl> control_;
  Scene scene_;
  std::uint32_t samples_ = 0;
  double seen_ = 0;
};

/// Two channels of 4 x 3 x 2 voxels: 0..23 and the same times ten.
inline std::shared_ptr<const Volume> smallVolume() {
  Grid grid;
  grid.dims = {4, 3, 2};
  std::vector<ChannelSource> channels(2);
  for (int c = 0; c < 2; ++c) {
    channels[std::size_t(c)].name = c == 0 ? "red" : "green";
    channels[std::size_t(c)].voxels = VoxelBuffer(ScalarType::u8, grid.voxelCount());
    for (std::size_t i = 0; i < grid.voxelCount(); ++i)
      channels[std::size_t(c)].voxels.as<std::uint8_t>()[i] = std::uint8_t(i * (c == 0 ? 1 : 10));
  }
  return std::make_shared<const Volume>(grid, std::move(channels));
}

inline std::shared_ptr<const DatasetStore> smallStore() {
  std::vector<Dataset> datasets;
  datasets.push_back({"small", "small.nrrd", {"small.nrrd"}, smallVolume()});
  datasets.push_back({"other", "other.nrrd", {"other.nrrd"}, smallVolume()});
  return std::make_shared<const DatasetStore>(std::move(datasets));
}

struct FakeViewer : ViewerSink {
  struct Offer {
    FrameInfo info;
    int width = 0, height = 0;
    float red = 0;  ///< the seed of the scene of all samples, -1 when they are mixed
    std::uint32_t patch = 0;
  };
  std::vector<Offer> frames;
  std::vector<std::pair<std::uint32_t, nlohmann::json>> scenes;
  std::vector<std::string> failures;
  std::string closed;

  void offerFrame(const EncodedFrame& frame, std::uint32_t patch) override {
    frames.push_back({frame.info, frame.width, frame.height, frame.image->pixels.front().r, patch});
  }
  void sceneChanged(std::uint32_t revision, const nlohmann::json& patch) override {
    scenes.emplace_back(revision, patch);
  }
  void renderFailed(const std::string& message) override { failures.push_back(message); }
  void sessionClosed(const std::string& reason) override { closed = reason; }
};

/// Both loops and a store, driven step by step by the test.
struct Workshop {
  FakeClock clock;
  std::shared_ptr<FakeControl> control = std::make_shared<FakeControl>();
  int renderWakes = 0, encoderWakes = 0;
  SessionHooks hooks{clock.now(), [this] { ++renderWakes; }, [this] { ++encoderWakes; },
                     [this] { render.interrupt(); }};
  std::shared_ptr<const SceneResolver> resolver =
      std::make_shared<const SceneResolver>(smallStore(), SceneResolver::Options{4096, 16'777'216});
  SessionStore store;
  RenderLoop render;
  EncodeLoop encode;

  explicit Workshop(SessionStore::Options options = {}, ProgressiveRender::Options policy = {})
      : store(resolver, options, hooks),
        render(
            store,
            [this](const std::shared_ptr<const Volume>&) {
              ++control->renderersMade;
              return std::make_unique<FakeRenderer>(control);
            },
            policy, clock.now(), [](const std::string&) {}, [](const PassResult&) {}),
        encode(store, clock.now(), [](const std::string&) {}) {
    control->clock = &clock;
  }

  /// A render step and an encoder step.
  void step() {
    render.step();
    encode.step();
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
};

inline nlohmann::json seedPatch(std::uint32_t seed) { return {{"integrator", {{"seed", seed}}}}; }

}  // namespace scolopax::server::testing
