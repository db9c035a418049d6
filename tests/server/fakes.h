// SPDX-License-Identifier: Apache-2.0
// A clock, a renderer and a viewer that tests control: nothing here waits or measures time.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/data/film.h"
#include "server/net/web_socket.h"
#include "server/progressive_render.h"
#include "server/render_loop.h"

namespace scolopax::server::testing {

/// A clock that stands still until it is advanced.
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

/// Controls and records all fake renderers of a test.
struct FakeControl {
  FakeClock* clock = nullptr;
  double secondsPerPixel = 0;        ///< how far a pass advances the clock
  std::function<void()> duringPass;  ///< called in the middle of each pass
  std::function<double(std::uint32_t samples)> error = [](std::uint32_t) { return 1.0; };
  std::string failure;       ///< if set, setScene throws an Error with this message
  int incompletePasses = 0;  ///< calls that use up their budget before the pass is complete
  std::vector<std::chrono::nanoseconds> budgets;  ///< of each call
  std::vector<std::uint32_t> passes;              ///< the scene's seed in each pass that was not cancelled
  std::vector<std::pair<int, int>> sizes;         ///< width and height in each such pass
  int renderersMade = 0;
  bool takesLong = false;                         ///< what takesLong() returns, for every scene
  bool choosingTakesLong = false;                 ///< the same, for scenes with the automatic method
  bool filmIsLarge = false;                       ///< what filmIsLarge() returns for small pictures
  std::function<void(std::stop_token)> building;  ///< called in setScene
  std::shared_ptr<MemoryBudget> memory;           ///< from which films take memory
  std::uint64_t filmPixelBytes = 1;               ///< how much per pixel
  std::uint32_t longErrorFrom =
      ~0u;  ///< from this many samples on the error takes long, until it is measured
  std::function<void(std::stop_token)> measuring;  ///< called during that measurement
  int incompletePicks = 0;           ///< calls that use up their budget before a pick is complete
  std::size_t samplesPerTurn = 8;    ///< samples that such a call takes
  std::function<void()> duringPick;  ///< called in the middle of each call
  int cancelledPicks = 0;            ///< calls that a cancel ended
  std::string pickFailure;           ///< if set, picks throw a std::runtime_error with this message
  std::vector<std::uint32_t> picks;  ///< the scene's seed in each pick that was begun
  std::vector<Picked> found;         ///< the result of each pick
};

/// Runs each job at once or, with atOnce false, only when finish() is called.
class FakeBackground : public Background {
 public:
  bool atOnce = true;
  std::vector<std::function<void()>> waiting;
  std::vector<std::string> flows;  ///< of all jobs

  std::shared_ptr<Job> start(const std::string& flow, Work work, std::function<void()> ended) override {
    flows.push_back(flow);
    auto job = std::make_shared<Job>(std::move(work));
    const auto run = [job, ended = std::move(ended)] {
      job->run();
      ended();
    };
    if (atOnce)
      run();
    else
      waiting.push_back(run);
    return job;
  }
  /// Runs the waiting jobs to their end.
  void finish() {
    for (const auto& run : std::exchange(waiting, {})) run();
  }
};

class FakePicking : public Picking {
 public:
  explicit FakePicking(std::shared_ptr<FakeControl> control) : control_(std::move(control)) {}
  bool run(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    if (!control_->pickFailure.empty()) throw std::runtime_error(control_->pickFailure);
    // A copy, because the function may replace itself.
    if (const auto during = control_->duringPick) during();
    if (cancel) return ++control_->cancelledPicks, false;
    if (control_->incompletePicks == 0) return true;
    if (control_->clock)
      control_->clock->advance(std::chrono::duration_cast<std::chrono::microseconds>(budget));
    samples_ += control_->samplesPerTurn;
    return --control_->incompletePicks, false;
  }
  std::size_t samples() const override { return samples_; }
  const std::vector<Picked>& found() const override { return control_->found; }

 private:
  const std::shared_ptr<FakeControl> control_;
  std::size_t samples_ = 0;
};

/// A renderer whose picture shows which scenes its samples belong to: red is the seed if they all belong to
/// one scene, otherwise -1; green is the number of samples.
class FakeRenderer : public Renderer {
 public:
  explicit FakeRenderer(std::shared_ptr<FakeControl> control) : control_(std::move(control)) {}
  std::string_view backendName() const override { return "fake"; }
  RebuildStats setScene(const Scene& scene, std::stop_token stop) override {
    if (control_->building) control_->building(stop);
    if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "stopped");
    if (!control_->failure.empty()) throw Error(ErrorCode::badInput, control_->failure);
    film_.resize(std::uint64_t(scene.width) * std::uint64_t(scene.height) * control_->filmPixelBytes);
    RebuildStats stats;
    stats.filmReset = samples_ == 0 || scene.seed != scene_.seed || scene.width != scene_.width ||
                      scene.height != scene_.height;
    if (stats.filmReset) samples_ = 0, measured_ = false;
    scene_ = scene;
    return stats;
  }
  bool takesLong(const Scene& scene) const override {
    return control_->takesLong || (control_->choosingTakesLong && scene.method == Method::automatic);
  }
  bool renderPixels(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    control_->budgets.push_back(budget);
    if (control_->incompletePasses > 0) {
      if (control_->clock)
        control_->clock->advance(std::chrono::duration_cast<std::chrono::microseconds>(budget));
      return --control_->incompletePasses, false;
    }
    const auto pixels = double(scene_.width) * scene_.height;
    if (control_->clock)
      control_->clock->advance(
          std::chrono::microseconds((long long)(pixels * control_->secondsPerPixel * 1e6)));
    // A copy, because the function may replace itself.
    if (const auto during = control_->duringPass) during();
    if (cancel) return false;
    seen_ = samples_ == 0 || seen_ == double(scene_.seed) ? double(scene_.seed) : -1;
    control_->passes.push_back(scene_.seed);
    control_->sizes.emplace_back(scene_.width, scene_.height);
    return true;
  }
  void addPixels() override { ++samples_; }
  bool filmIsLarge() const override {
    return control_->filmIsLarge ||
           std::uint64_t(scene_.width) * std::uint64_t(scene_.height) >= kLargePicture;
  }
  Choice choice() const override { return {scene_.method, scene_.step, {}}; }
  std::uint32_t samples() const override { return samples_; }
  double estimatedError(std::stop_token stop) const override {
    if (errorTakesLong()) {
      if (control_->measuring) control_->measuring(stop);
      if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "stopped");
      measured_ = true;
    }
    return control_->error(samples_);
  }
  bool errorTakesLong() const override { return !measured_ && samples_ >= control_->longErrorFrom; }
  void countCosts() override {}
  RenderStats stats() const override { return {}; }
  void recordAovs() override { samples_ = 0; }
  AovValues aov(Aov which) const override { return {which, 1, 1, {float(samples_)}}; }
  std::unique_ptr<Picking> pick(const Scene&, const PixelArea&) const override {
    control_->picks.push_back(scene_.seed);
    return std::make_unique<FakePicking>(control_);
  }
  Image image() const override {
    Image image{scene_.width, scene_.height, {}};
    image.pixels.assign(std::size_t(scene_.width) * std::size_t(scene_.height),
                        glm::vec4(float(seen_), float(samples_), 0, 1));
    return image;
  }

 private:
  const std::shared_ptr<FakeControl> control_;
  MemoryBudget::Share film_ = MemoryBudget::take(control_->memory, MemoryUse::films);
  Scene scene_;
  std::uint32_t samples_ = 0;
  mutable bool measured_ = false;
  double seen_ = 0;
};

/// Two channels of 4 x 3 x 2 voxels: 0..23, and ten times these values.
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

inline std::shared_ptr<const DatasetStore> smallStore(const std::shared_ptr<MemoryBudget>& memory = nullptr) {
  std::vector<io::LoadedDataset> datasets;
  datasets.push_back({"small", "small.nrrd", {"small.nrrd"}, smallVolume()});
  datasets.push_back({"other", "other.nrrd", {"other.nrrd"}, smallVolume()});
  return std::make_shared<const DatasetStore>(std::move(datasets), memory);
}

struct FakeViewer : ViewerSink {
  struct Offer {
    FrameInfo info;
    int width = 0, height = 0;
    float red = 0;  ///< the scene's seed; -1 if samples of several scenes are mixed; -2 for a dropped picture
    std::uint32_t patch = 0;
  };
  std::vector<Offer> frames;
  std::vector<std::pair<std::uint32_t, nlohmann::json>> scenes;
  std::vector<net::SharedText> messages;  ///< that tell of these scenes
  std::vector<std::string> failures;
  std::string closed;

  void offerFrame(const EncodedFrame& frame, std::uint32_t patch) override {
    const float red = frame.image ? frame.image->pixels.front().r : -2;
    frames.push_back({frame.info, frame.width, frame.height, red, patch});
  }
  void sceneChanged(const net::SharedText& message) override {
    const auto parsed = nlohmann::json::parse(*message);
    scenes.emplace_back(parsed["revision"], parsed["patch"]);
    messages.push_back(message);
  }
  void renderFailed(const Error& error) override { failures.emplace_back(error.what()); }
  void sessionClosed(const std::string& reason) override { closed = reason; }
};

/// Both loops and a store, which the test drives step by step.
struct Workshop {
  FakeClock clock;
  std::shared_ptr<FakeControl> control = std::make_shared<FakeControl>();
  int renderWakes = 0, encoderWakes = 0, watchWakes = 0;
  std::vector<std::string> log;  ///< of the render loop
  SessionHooks hooks{clock.now(), [this] { ++renderWakes; }, [this] { ++encoderWakes; },
                     [this] { render.interrupt(); }};
  std::shared_ptr<const SceneResolver> resolver =
      std::make_shared<const SceneResolver>(smallStore(), SceneResolver::Options{16'777'216});
  SessionStore store;
  FakeBackground background, passes, errors;
  PassResult last;  ///< the result of the render loop's last turn
  RenderLoop render;
  EncodeLoop encode;

  explicit Workshop(SessionStore::Options options = {32, std::chrono::minutes(5)},
                    const std::shared_ptr<MemoryBudget>& memory = nullptr)
      : store(resolver, options, hooks),
        render(store,
               {[this](const std::shared_ptr<const Volume>&) {
                  ++control->renderersMade;
                  return std::make_unique<FakeRenderer>(control);
                },
                {},
                clock.now(),
                [this](const std::string& line) { log.push_back(line); },
                background,
                passes,
                errors,
                background,
                [this] { ++renderWakes; },
                memory,
                [this] { ++watchWakes; }},
               [this](const PassResult& pass) { last = pass; }),
        encode(
            store, clock.now(), [](const std::string&) {}, background, [this] { ++encoderWakes; }) {
    control->clock = &clock;
    control->memory = memory;
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
/// Switches on gradient opacity in the first channel, with a range that must be measured.
inline nlohmann::json gradientPatch() {
  return {{"channels", {{"0", {{"gradientOpacity", nlohmann::json::object()}}}}}};
}

}  // namespace scolopax::server::testing
