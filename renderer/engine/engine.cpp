// SPDX-License-Identifier: Apache-2.0
// The engine: makes render plans, owns the film, has a launcher render passes, and keeps errors, costs and
// AOVs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/data/film.h"
#include "renderer/data/pixel_loops.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/data/scene_checks.h"
#include "renderer/engine/corrections.h"
#include "renderer/engine/costs.h"
#include "renderer/engine/picking.h"
#include "renderer/engine/pilot.h"
#include "renderer/engine/step_bias.h"
#include "renderer/launcher.h"
#include "renderer/renderer.h"

namespace scolopax {
namespace {

class Engine final : public Renderer {
 public:
  Engine(std::unique_ptr<Launcher> launcher, std::shared_ptr<const Volume> volume,
         std::shared_ptr<MemoryBudget> memory)
      : launcher_(std::move(launcher)),
        budget_(std::move(memory)),
        memory_(MemoryBudget::take(budget_, MemoryUse::films)),
        volume_(std::move(volume)) {}

  std::string_view backendName() const override { return launcher_->name(); }

  RebuildStats setScene(const Scene& scene, std::stop_token stop) override {
    Film resized;
    const bool newSize = scene.width != film_.width() || scene.height != film_.height();
    checkImageSize(scene);
    const std::size_t bytes = filmBytes(std::size_t(scene.width) * std::size_t(scene.height), scene);
    const std::uint64_t bytesBefore = memory_.bytes();
    RebuildStats stats;
    try {
      // Memory first: if there is not enough, the plan and the film stay as they were.
      memory_.resize(std::max<std::uint64_t>(bytesBefore, bytes));
      if (newSize) resized.reset(scene.width, scene.height);
      launcher_->run([&] { stats = take(scene, stop); });
    } catch (...) {
      memory_.resize(bytesBefore);
      throw;
    }
    if (newSize)
      film_ = std::move(resized);
    else if (stats.filmReset)
      film_.reset(scene.width, scene.height);
    if (stats.filmReset) {
      memory_.resize(bytes);
      resetRecords();
      bias_.reset();
    }
    return stats;
  }
  bool takesLong(const Scene& scene) const override {
    const auto pixels = std::size_t(scene.width) * std::size_t(scene.height);
    // Freeing the memory of a large film takes time, and so does clearing the records.
    const bool largeFilm = (filmIsLarge() || filmBytes(pixels, scene) >= kLargeBytes) &&
                           (pixels != film_.pixelCount() || recording_ || counting_);
    return largeFilm || scene.method == Method::automatic || !plan_ || plan_->nextTakesLong(scene) ||
           launcher_->uploadTakesLong(*plan_, scene);
  }
  bool filmIsLarge() const override {
    return plan_ && filmBytes(film_.pixelCount(), plan_->scene()) >= kLargeBytes;
  }
  Choice choice() const override {
    const Scene& scene = plan_->scene();
    Choice choice{scene.method, hasStep(scene.method) ? scene.step : 0, {}};
    for (std::size_t l = 0; l < film_.levels() && film_.isIncluded(l); ++l)
      choice.corrections.push_back({sceneStep(corrections_.levels()[l].estimate.fine), film_.corrections(l)});
    return choice;
  }

  bool renderPixels(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    Pass pass{.plan = plan_.get(),
              .method = plan_->scene().method,
              .scene = plan_->view(),
              .number = sampleNumber(plan_->scene().sampling, film_.samples()),
              .pixels = film_.pass(),
              .cost = costs_.pass(),
              .first = recording_ ? first_.pass() : nullptr,
              .done = done_.data(),
              .cancel = &cancel,
              .deadline = std::chrono::steady_clock::now() + budget};
    if (automaticChosen_ && hasStep(automatic_.method)) setResolution(pass.scene, automatic_.resolution);
    bool complete = false;
    launcher_->run([&] {
      complete = launcher_->launch(pass) && corrections_.render(
                                                *launcher_, *plan_, film_, [&] { return addLevel(); },
                                                correctionCosts_.pass(), cancel, pass.deadline);
    });
    return complete;
  }
  void addPixels() override {
    launcher_->run([&] {
      film_.add();
      corrections_.add(film_);
      noise_.reset();
      if (recording_) first_.add(plan_->visibleChannels());
      costs_.add(recording_ ? fetches_.data() : nullptr);
      correctionCosts_.add();
      std::fill(done_.begin(), done_.end(), std::uint8_t(0));
    });
  }

  std::uint32_t samples() const override { return film_.samples(); }
  double estimatedError(std::stop_token stop) const override {
    if (!noise_) launcher_->run([&] { noise_ = film_.noise(); });
    if (errorTakesLong()) launcher_->run([&] { bias_ = estimateBias(*launcher_, *plan_, stop); });
    return std::hypot(
        *noise_, corrections_.levels().empty() ? bias_.value_or(0) : biasLeft(corrections_.levels(), film_));
  }
  bool errorTakesLong() const override {
    // A film of few samples may be one of many that edits cause, and is not worth the thumbnails.
    return plan_ && hasStep(plan_->scene().method) && !bias_ && corrections_.levels().empty() &&
           film_.samples() >= kSamplesWorthBias;
  }
  Image image() const override {
    Image image;
    launcher_->run([&] { image = film_.image(); });
    return image;
  }

  void countCosts() override {
    counting_ = countingCorrections_ = true;
    resetRecords();
  }
  RenderStats stats() const override { return withWork(costs_.sums(), correctionCosts_.sums()); }

  void recordAovs() override {
    counting_ = recording_ = true;
    if (film_.pixelCount() > 0) memory_.resize(filmBytes(film_.pixelCount(), plan_->scene()));
    if (film_.pixelCount() > 0) film_.reset(film_.width(), film_.height());
    resetRecords();
  }

  AovValues aov(Aov which) const override {
    AovValues result{which, film_.width(), film_.height(), {}};
    result.values.assign(film_.pixelCount(), std::numeric_limits<float>::quiet_NaN());
    if (!recording_ || film_.samples() == 0) return result;
    launcher_->run([&] {
      switch (which) {
        case Aov::depth:
          result.values = first_.depth();
          break;
        case Aov::transmittance:
          result.values = film_.transmittance();
          break;
        case Aov::channel:
          result.values = first_.channel();
          break;
        case Aov::cost:
          std::transform(fetches_.begin(), fetches_.end(), result.values.begin(),
                         [&](std::uint64_t n) { return float(double(n) / film_.samples()); });
          break;
      }
    });
    return result;
  }

  std::unique_ptr<Picking> pick(const Scene& scene, const PixelArea& area) const override {
    return makePicking(launcher_, plan_, scene, area);
  }

 private:
  /// Makes the plan of a scene. For Method::automatic, chooses method and step if the previous choice is not
  /// valid.
  RebuildStats take(const Scene& scene, const std::stop_token& stop) {
    Scene chosen = scene;
    const bool automatic = scene.method == Method::automatic;
    AutomaticChoice choice = automatic_;
    std::shared_ptr<const RenderPlan> plan = plan_;
    RebuildStats stats;
    const auto makeNext = [&] {
      plan = std::make_shared<const RenderPlan>(volume_, chosen, plan.get(), budget_, stop);
      const RebuildStats& own = plan->rebuilt();
      stats.macrocellChannels += own.macrocellChannels;
      stats.majorantChannels += own.majorantChannels;
      stats.majorantCells += own.majorantCells;
      stats.rebuildMs += own.rebuildMs;
    };
    if (automatic) {
      // Tries the previous choice first: if nothing else has changed, the film is kept.
      chosen.method = choice.method;
      chosen.step = sceneStep(choice.resolution);
      if (!plan_ || !automaticChosen_ || !makeSameFilm(plan_->scene(), chosen)) {
        makeNext();
        choice = chooseAutomatically(*launcher_, *plan, stop);
      }
      chosen.method = choice.method;
      chosen.step = sceneStep(choice.resolution);
    }
    makeNext();
    launcher_->upload(plan, stop);
    stats.filmReset = !plan_ || automatic != automaticChosen_ || !makeSameFilm(plan_->scene(), chosen);
    plan_ = std::move(plan);
    automatic_ = std::move(choice);
    automaticChosen_ = automatic;
    return stats;
  }

  /// Bytes of a film of this size, with all records of its pixels.
  std::size_t filmBytes(std::size_t pixels, const Scene& scene) const {
    const std::size_t counted = counting_ && !recording_ ? Costs::kPixelBytes : 0;
    const std::size_t ofCorrections = countingCorrections_ ? Costs::kPixelBytes : 0;
    return pixels * (filmPixelBytes(scene.channels.size(), recording_) + counted + ofCorrections);
  }

  /// Adds a level of corrections to the film, if there is memory for it.
  bool addLevel() {
    const std::uint64_t before = memory_.bytes();
    const std::size_t bytes =
        film_.levels() == 0 ? Film::kFirstLevelBytes + sizeof(std::uint8_t) : Film::kLevelBytes;
    try {
      memory_.resize(before + film_.pixelCount() * bytes);
      film_.addLevel();
      return true;
    } catch (const Error&) {
      memory_.resize(before);
      return false;
    }
  }

  void resetRecords() {
    const std::size_t pixels = film_.pixelCount();
    noise_.reset();
    corrections_.reset(automaticChosen_ ? automatic_.levels : std::vector<Level>());
    try {
      done_.assign(pixels, 0);
      costs_.reset(counting_ ? pixels : 0);
      correctionCosts_.reset(countingCorrections_ && !corrections_.levels().empty() ? pixels : 0);
      if (!recording_ || pixels == 0) return;
      fetches_.assign(pixels, 0);
      first_.reset(pixels, plan_->scene().channels.size());
    } catch (const std::bad_alloc&) {
      throw Error(ErrorCode::tooLarge, "image: no memory for the records of " +
                                           std::to_string(film_.width()) + "x" +
                                           std::to_string(film_.height()) + " pixels");
    }
  }

  /// Those of a film of kLargePicture pixels without records.
  static constexpr std::size_t kLargeBytes = kLargePicture * (Film::kPixelBytes + sizeof(std::uint8_t));

  const std::shared_ptr<Launcher> launcher_;  // shared with picks
  const std::shared_ptr<MemoryBudget> budget_;
  MemoryBudget::Share memory_;  // for the film and its records
  const std::shared_ptr<const Volume> volume_;
  std::shared_ptr<const RenderPlan> plan_;  // null until there is a scene
  Film film_;
  std::vector<std::uint8_t> done_;  // pixels that the current pass has rendered
  bool counting_ = false, countingCorrections_ = false, recording_ = false;
  Costs costs_, correctionCosts_;       // of the film's samples and of their corrections
  std::vector<std::uint64_t> fetches_;  // one per pixel while recording
  FirstCollisions first_;
  static constexpr std::uint32_t kSamplesWorthBias = 16;
  AutomaticChoice automatic_;
  bool automaticChosen_ = false;  // automatic_ is that of the current scene
  Corrections corrections_;
  mutable std::optional<double> noise_;  // of the current film, once its error was requested
  mutable std::optional<double> bias_;   // of the current film, once it is known
};

}  // namespace

std::size_t filmPixelBytes(std::size_t channels, bool aovs) {
  const std::size_t records =
      aovs ? Costs::kPixelBytes + sizeof(std::uint64_t) + FirstCollisions::pixelBytes(channels) : 0;
  return Film::kPixelBytes + sizeof(std::uint8_t) + records;
}

std::unique_ptr<Renderer> makeRenderer(std::unique_ptr<Launcher> launcher,
                                       std::shared_ptr<const Volume> volume,
                                       std::shared_ptr<MemoryBudget> memory) {
  return std::make_unique<Engine>(std::move(launcher), std::move(volume), std::move(memory));
}

}  // namespace scolopax
