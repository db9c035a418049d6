// SPDX-License-Identifier: Apache-2.0
#include "server/progressive_render.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <exception>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/data/film.h"
#include "server/blend.h"
#include "server/stop_rule.h"

namespace scolopax::server {
namespace {

constexpr double kDivisors[] = {1, 1.5, 2, 3, 4, 6, 8, 12, 16};
/// Of quadrature, in voxels, while edits arrive.
constexpr double kInteractiveStep = 2;
constexpr double kProbeDivisor = 4;
constexpr double kMostDivisor = 16;
constexpr double kFiner = 0.7, kKept = 1.2;  ///< shares of the target at which the divisor changes

double secondsBetween(TimePoint from, TimePoint to) {
  return std::chrono::duration<double>(to - from).count();
}

std::uint32_t microseconds(double seconds) { return std::uint32_t(std::clamp(seconds * 1e6, 0.0, 4e9)); }

const std::atomic<bool> kNever{false};

}  // namespace

double divisorForTarget(std::uint64_t pixels, double secondsPerPixel, double targetSeconds, double current) {
  for (const double divisor : kDivisors) {
    const double share = current == 0 || divisor > current ? 1 : divisor < current ? kFiner : kKept;
    if (double(pixels) / (divisor * divisor) * secondsPerPixel <= targetSeconds * share) return divisor;
  }
  return kDivisors[std::size(kDivisors) - 1];
}

Scene atDivisor(Scene scene, double divisor) {
  if (divisor == 1) return scene;
  const int height = int(std::ceil(scene.height / divisor));
  scene.width = int((std::int64_t(scene.width) * height + scene.height - 1) / scene.height);
  scene.height = height;
  scene.filter = PixelFilter::point;
  return scene;
}

namespace {
/// What is drawn while edits arrive, or soon after. The method is ours to choose only where the scene leaves
/// it to the server: then the quickest that looks like the picture at rest.
Scene drawnScene(const ResolvedScene& resolved, double divisor, bool interactive) {
  Scene scene = atDivisor(resolved.render, divisor);
  if (interactive && scene.method == Method::automatic) {
    scene.method = Method::hybrid;
    scene.step = kInteractiveStep;
  }
  return scene;
}
}  // namespace

/// A scene on its way into the renderer.
struct ProgressiveRender::Taking {
  RenderRequest request;
  TimePoint begin;
  double divisor = 1;
  Scene scene;
  bool record = false;  ///< from this scene on, AOVs are recorded
  bool inBackground = false;
  std::shared_ptr<Renderer> renderer;
  RebuildStats stats;

  /// Whether the expensive part of this build is useless for `other`.
  bool uselessFor(const RenderRequest& other) const {
    return other.scene->dataset->volume != request.scene->dataset->volume ||
           other.scene->render.macrocell != scene.macrocell;
  }
};

/// A picture on its way out of the film.
struct ProgressiveRender::Showing {
  RenderedFrame frame;
  bool interactive = false;              ///< made while edits arrive
  bool aovs = false;                     ///< made with them
  std::shared_ptr<const Image> reduced;  ///< to be mixed in; null: nothing is
  double sampleError = 0;
  double share = 0;  ///< of the new picture in the mixture

  /// Throws Error(cancelled) when it is stopped while the error is measured.
  void make(const Renderer& renderer, std::uint64_t pixels, const std::shared_ptr<MemoryBudget>& memory,
            const std::stop_token& stop) {
    FrameInfo& info = frame.info;
    info.error = float(renderer.estimatedError(stop));
    const auto take = [&](std::size_t pixelBytes) {
      return MemoryBudget::take(memory, MemoryUse::pictures, pixels * pixelBytes);
    };
    // Mixing makes another one of the reduced picture.
    auto imageMemory = take(sizeof(glm::vec4) * (reduced ? 2 : 1));
    auto aovMemory = take(aovs ? std::size(kAovs) * sizeof(float) : 0);
    Image picture = renderer.image();
    if (reduced) {
      const double error = info.samples > 1 ? double(info.error) : sampleError;
      share = mixIn(enlarged(*reduced, picture.width, picture.height), error, &picture);
      info.mixed = true;
    }
    imageMemory.resize(pixels * sizeof(glm::vec4));
    frame.image = withShare(std::move(imageMemory), std::move(picture));
    if (!aovs) return;
    std::vector<AovValues> values;
    for (std::size_t i = 0; i < std::size(kAovs); ++i) values.push_back(renderer.aov(Aov(i)));
    frame.aovs = withShare(std::move(aovMemory), std::move(values));
  }
};

ProgressiveRender::ProgressiveRender(std::shared_ptr<Session> session, const RenderContext& context,
                                     const std::atomic<bool>& interrupted)
    : session_(std::move(session)), context_(context), interrupted_(interrupted) {}

ProgressiveRender::~ProgressiveRender() {
  if (job_) job_->cancel();
  dropRenderer();
}

/// Memory of large films takes its time to be given back.
void ProgressiveRender::dropRenderer() {
  pick_.forget();
  scene_.reset();
  volume_.reset();
  recording_ = unfinished_ = false;
  if (!renderer_) return;
  context_.background.start([last = std::move(renderer_)](const std::stop_token&) {}, [] {});
  renderer_.reset();
}

bool ProgressiveRender::sceneStale(const RenderRequest& request) const {
  // Back to full resolution when edits have stopped, in steps; a film that already has it goes on.
  const bool finerDue = divisor_ != 1 && (small_ || restShown_ || !request.pollSamples.empty());
  return !scene_ || request.revision != revision_ || (!request.interactive && finerDue) ||
         (request.aovs && !recording_);
}

/// Whether a pass whose scene is stale goes on all the same, for a while: the first of a small picture, and
/// of one that follows an abandoned pass. However fast edits come, pictures are shown between them.
bool ProgressiveRender::keepsPass(const RenderRequest& request) const {
  return unfinished_ && shown_.revision != revision_ && ((request.interactive && small_) || abandoned_) &&
         context_.now() - passBegan_ < context_.policy.shield;
}

/// Whether the first picture of an edit turns out to cost much more than the passes before it.
bool ProgressiveRender::lateForEdit(const RenderRequest& request) const {
  return unfinished_ && small_ && firstOfEdit(request) && divisor_ < kMostDivisor &&
         passSeconds_ >= std::chrono::duration<double>(context_.policy.tooLate).count();
}

/// Whether somebody waits for the first picture that has an edit in it.
bool ProgressiveRender::firstOfEdit(const RenderRequest& request) const {
  return request.interactive && shown_.revision != request.revision;
}

/// Whether the renderer has the scene that a pick asks about, and is not at work on another.
bool ProgressiveRender::pickable(const RenderRequest& request) const {
  return request.pick && scene_ && !taking_ && revision_ == request.revision;
}

bool ProgressiveRender::finished(const RenderRequest& request) const {
  return stopMet(request.scene->stop, *renderer_, filmSeconds_);
}

/// Whether the film as it stands is worth a frame.
bool ProgressiveRender::showDue(const RenderRequest& request) const {
  const std::uint32_t samples = renderer_->samples();
  if (samples == 0) return false;
  if (shown_.revision != revision_ || shown_.interactive != request.interactive) return true;
  if (request.failures != shownFailures_) return true;
  if (shown_.mixed && !request.pollSamples.empty()) return true;
  if (!request.interactive && divisor_ == 1 && finished(request)) return !shown_.final;
  if (samples == shown_.samples) return false;
  if (std::any_of(request.pollSamples.begin(), request.pollSamples.end(),
                  [&](std::uint32_t wanted) { return shown_.samples < wanted && wanted <= samples; }))
    return true;
  return std::has_single_bit(samples) ||
         context_.now() - shownAt_ >=
             (request.interactive ? context_.policy.interactiveInterval : context_.policy.stillInterval);
}

ProgressiveRender::Work ProgressiveRender::work() const {
  const RenderRequest request = session_->request();
  if (pickable(request)) return Work::urgent;
  if (job_ && !job_->done()) return Work::none;
  if (job_) return firstOfEdit(request) ? Work::urgent : Work::still;
  if (!request.wanted || !(sceneStale(request) || !finished(request) || showDue(request))) return Work::none;
  return firstOfEdit(request) ? Work::urgent : request.interactive ? Work::refine : Work::still;
}

bool ProgressiveRender::edited() const {
  const RenderRequest request = session_->request();
  return request.wanted && request.interactive;
}

std::optional<TimePoint> ProgressiveRender::dueAt() const {
  if (job_) return std::nullopt;  // whose end wakes the loop
  const RenderRequest request = session_->request();
  if (!request.wanted || request.retryAt) return request.retryAt;
  // Also when the end has just passed, between work() and here: then it is due at once.
  if (request.interactive || shown_.interactive) return request.interactiveEnd;
  return std::nullopt;
}

double ProgressiveRender::wantedDivisor(const RenderRequest& request, int editedOthers) const {
  // What a pass costs is not known before the first: a small one tells. That of the other kind is a first
  // guess.
  const auto& known = secondsPerPixel_[request.interactive] ? secondsPerPixel_[request.interactive]
                                                            : secondsPerPixel_[!request.interactive];
  if (!request.interactive && (!request.pollSamples.empty() || !known)) return 1;
  if (!known) return kProbeDivisor;
  const auto pixels =
      std::uint64_t(request.scene->render.width) * std::uint64_t(request.scene->render.height);
  if (!request.interactive) {
    const bool reducedShown = shown_.revision == request.revision && shown_.reduced;
    double seconds = std::chrono::duration<double>(context_.policy.frameTarget).count(), divisor = 1;
    do divisor = divisorForTarget(pixels, *known, seconds *= context_.policy.restFactor);
    while (divisor > 1 && reducedShown && divisor >= divisor_);
    return divisor;
  }
  // All that are edited together have two targets a round, so that the picture stays sharp when they are few.
  const auto target =
      std::max(2 * context_.policy.frameTarget / std::max(2, 1 + editedOthers), context_.policy.leastTarget);
  return divisorForTarget(pixels, *known, std::chrono::duration<double>(target).count(), interactiveDivisor_);
}

std::uint64_t ProgressiveRender::filmSize() const {
  const Scene scene = atDivisor(scene_->render, divisor_);
  return std::uint64_t(scene.width) * std::uint64_t(scene.height);
}

bool ProgressiveRender::largeFilm() const { return filmSize() >= kLargePicture; }

/// An abandoned pass cost at least this much; assume it was half done.
void ProgressiveRender::learnFromUnfinished() {
  if (!unfinished_ || !scene_) return;
  auto& known = secondsPerPixel_[small_];
  known = std::max(known.value_or(0), 2 * passSeconds_ / double(filmSize()));
}

void ProgressiveRender::perform(bool inBackground, Background::Work work, Next next, PassResult& result) {
  if (!inBackground) {
    work({});
    (this->*next)(result);
    return;
  }
  next_ = next;
  job_ = context_.background.start(std::move(work), context_.wake);
  if (job_->done()) collect(result);
}

void ProgressiveRender::collect(PassResult& result) {
  const auto job = std::exchange(job_, nullptr);
  try {
    job->rethrow();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    result.abandoned = taking_ != nullptr;
    taking_.reset();
    showing_.reset();
    return;
  }
  (this->*next_)(result);
}

void ProgressiveRender::supervise() {
  if (!job_ || job_->done()) return;
  const RenderRequest request = session_->request();
  const bool useless = taking_ ? taking_->uselessFor(request) : showing_ && sceneStale(request);
  if (!request.wanted || useless) job_->cancel();
}

void ProgressiveRender::takeScene(const RenderRequest& request, const Others& others, PassResult& result) {
  pick_.forget();
  if (small_) learnFromUnfinished();
  const auto volume = request.scene->dataset->volume;
  if (volume_ != volume) {
    dropRenderer();
    secondsPerPixel_[false].reset();
    secondsPerPixel_[true].reset();
    interactiveDivisor_ = 0;
  }
  volume_ = volume;
  abandoned_ = unfinished_;
  unfinished_ = false;
  taking_ = std::make_shared<Taking>();
  taking_->request = request;
  taking_->begin = context_.now();
  taking_->divisor = wantedDivisor(request, others.edited);
  taking_->scene = drawnScene(*request.scene, taking_->divisor, request.interactive);
  taking_->record = request.aovs && !recording_;
  taking_->renderer = renderer_;
  taking_->inBackground = !renderer_ || renderer_->takesLong(taking_->scene);
  const auto build = [taking = taking_, volume, make = context_.makeRenderer](const std::stop_token& stop) {
    if (!taking->renderer) taking->renderer = make(volume);
    taking->stats = taking->renderer->setScene(taking->scene, stop);
    if (taking->record) taking->renderer->recordAovs();
  };
  perform(taking_->inBackground, build, &ProgressiveRender::sceneTaken, result);
}

void ProgressiveRender::sceneTaken(PassResult& result) {
  const auto taking = std::exchange(taking_, nullptr);
  const RenderRequest& request = taking->request;
  renderer_ = taking->renderer;
  if (taking->record) {
    recording_ = true;
    shown_ = {};  // the frames so far do not count: they hold no AOVs
  }
  if (taking->stats.filmReset || taking->record) filmSeconds_ = 0;
  if (request.interactive || revision_ != request.revision) reduced_.reset();
  scene_ = request.scene;
  revision_ = request.revision;
  divisor_ = taking->divisor;
  small_ = request.interactive;
  restShown_ = false;
  if (small_ && (secondsPerPixel_[false] || secondsPerPixel_[true])) interactiveDivisor_ = divisor_;
  result.built = taking->inBackground;
  result.rebuildSeconds = secondsBetween(taking->begin, context_.now());
  rebuildUs_ = microseconds(result.rebuildSeconds);
}

void ProgressiveRender::addSample(bool urgent, bool othersUrgent, PassResult& result) {
  const TimePoint begin = context_.now();
  if (!unfinished_) passBegan_ = begin, passSeconds_ = 0;
  // The turn between two urgent ones is short, and its own: however fast edits come, it gets on.
  const bool whole = urgent || othersUrgent;
  const RenderPolicy& policy = context_.policy;
  const auto slice = urgent ? policy.tooLate : othersUrgent ? policy.politeSlice : policy.slice;
  const bool complete = renderer_->renderPixels(whole ? kNever : interrupted_, slice);
  result.cancelled = !complete && !whole && interrupted_;
  passSeconds_ += secondsBetween(begin, context_.now());
  unfinished_ = !complete;
  if (!complete) return;
  const auto add = [renderer = renderer_, estimate = scene_->stop.error > 0](const std::stop_token&) {
    renderer->addPixels();
    // So that it is known when it is asked for; what takes long is left to show().
    if (estimate && !renderer->errorTakesLong()) renderer->estimatedError();
  };
  perform(largeFilm(), add, &ProgressiveRender::sampleAdded, result);
}

void ProgressiveRender::sampleAdded(PassResult& result) {
  abandoned_ = false;
  result.rendered = true;
  result.renderSeconds = passSeconds_;
  result.pixels = filmSize();
  filmSeconds_ += result.renderSeconds;
  renderUs_ = microseconds(result.renderSeconds);
  const double perPixel = result.renderSeconds / double(result.pixels);
  auto& known = secondsPerPixel_[small_];
  known = known ? 0.5 * (*known + perPixel) : perPixel;
}

void ProgressiveRender::show(const RenderRequest& request, PassResult& result) {
  shownFailures_ = request.failures;
  showing_ = std::make_shared<Showing>();
  FrameInfo& info = showing_->frame.info;
  info.revision = revision_;
  info.samples = renderer_->samples();
  info.method = renderer_->choice().method;
  info.rebuildUs = rebuildUs_;
  info.renderUs = renderUs_;
  info.reduced = divisor_ != 1;
  info.interactive = request.interactive || info.reduced;
  info.final = !info.interactive && finished(request);
  showing_->frame.background = scene_->render.background;
  showing_->interactive = request.interactive;
  showing_->aovs = recording_ && !request.interactive;
  // The reduced picture that is on screen, into the one that takes its place.
  if (!request.interactive && !info.final && request.pollSamples.empty()) showing_->reduced = reduced_;
  showing_->sampleError = sampleError_;
  const auto make = [showing = showing_, renderer = renderer_, pixels = filmSize(), memory = context_.memory](
                        const std::stop_token& stop) { showing->make(*renderer, pixels, memory, stop); };
  perform(largeFilm() || renderer_->errorTakesLong(), make, &ProgressiveRender::pictureMade, result);
}

void ProgressiveRender::pictureMade(PassResult&) {
  const auto showing = std::exchange(showing_, nullptr);
  const FrameInfo& info = showing->frame.info;
  if (info.mixed && showing->share > 0.98) reduced_.reset();
  if (info.reduced) {
    reduced_ = showing->frame.image;
    if (showing->interactive)
      sampleError_ = info.samples > 1 ? double(info.error) * std::sqrt(info.samples) : 0;
  }
  restShown_ = !showing->interactive;
  shown_ = info;
  shownAt_ = context_.now();
  session_->submit(std::move(showing->frame));
}

/// A slice of a pick, if there is one and the last turn was not for one.
bool ProgressiveRender::pickIn(const RenderRequest& request) {
  pickedLast_ = pickable(request) && !pickedLast_;
  if (pickedLast_)
    pick_.run(*request.pick, *request.scene, revision_, *renderer_, context_.policy.politeSlice, *session_);
  return pickedLast_;
}

void ProgressiveRender::turn(const RenderRequest& request, const Others& others, PassResult& result) {
  if (pickIn(request)) return;
  if (job_ && !job_->done()) return;
  const bool collected = job_ != nullptr;
  bool took = taking_ != nullptr;
  if (collected) collect(result);
  if (!request.wanted || job_) return;
  if ((sceneStale(request) && !keepsPass(request)) || lateForEdit(request)) {
    takeScene(request, others, result);
    took = true;
  }
  if (job_ || !scene_) return;
  if (took && pickIn(request)) return;  // who waits for it need not wait for a pass
  // What was added in the background is shown before the next pass begins.
  if (collected && !unfinished_ && showDue(request)) return show(request, result);
  const bool othersWait = others.urgent || request.pick;
  if (!finished(request)) addSample(firstOfEdit(request), othersWait, result);
  if (!job_ && !unfinished_ && showDue(request)) show(request, result);
}

PassResult ProgressiveRender::run(const Others& others) {
  PassResult result;
  const RenderRequest request = session_->request();
  try {
    turn(request, others, result);
    return result;
  } catch (const Error& error) {
    fail(request, error);
  } catch (const std::bad_alloc&) {
    fail(request, Error(ErrorCode::tooLarge, "not enough memory to render this scene"));
  } catch (const std::exception& error) {
    context_.log(std::string("session ") + session_->id() + ": the renderer failed: " + error.what());
    fail(request, Error(ErrorCode::unsupported, "the renderer failed"));  // the cause is not for a client
  }
  return result;
}

void ProgressiveRender::fail(const RenderRequest& request, const Error& error) {
  // What failed may be of a scene that an edit has replaced in the meantime.
  const std::uint32_t revision = taking_ ? taking_->request.revision : scene_ ? revision_ : request.revision;
  session_->fail(revision, error);
  // What an error has left behind is not worth keeping.
  taking_.reset();
  showing_.reset();
  dropRenderer();
}

}  // namespace scolopax::server
