// SPDX-License-Identifier: Apache-2.0
#include "server/progressive_render.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <exception>
#include <utility>

#include "renderer/core/error.h"
#include "server/blend.h"

namespace scolopax::server {
namespace {

constexpr double kDivisors[] = {1, 1.5, 2, 3, 4, 6, 8, 12, 16};
/// Of quadrature, in voxels, while edits arrive.
constexpr double kInteractiveStep = 2;
constexpr double kProbeDivisor = 4;
constexpr double kMostDivisor = 16;
constexpr double kFiner = 0.7, kKept = 1.2;  ///< shares of the target at which the divisor changes
/// As many as a scene may ask for; numbers of samples beyond 2^31 would repeat draws.
constexpr std::uint32_t kMaxSamples = 1u << 24;

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

bool stopMet(const StopRule& stop, const Renderer& renderer, double seconds) {
  const std::uint32_t samples = renderer.samples();
  // The estimate counts from 16 samples on: fewer can look alike by chance.
  return samples > 0 && (samples >= kMaxSamples || (stop.samples > 0 && samples >= stop.samples) ||
                         (stop.seconds > 0 && seconds >= stop.seconds) ||
                         (stop.error > 0 && samples >= 16 && renderer.estimatedError() <= stop.error));
}

ProgressiveRender::ProgressiveRender(std::shared_ptr<Session> session, MakeRenderer makeRenderer,
                                     Options options, Now now, Log log, const std::atomic<bool>& interrupted)
    : session_(std::move(session)),
      makeRenderer_(std::move(makeRenderer)),
      options_(options),
      now_(std::move(now)),
      log_(std::move(log)),
      interrupted_(interrupted) {}

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
         now_() - passBegan_ < options_.shield;
}

/// Whether the first picture of an edit turns out to cost much more than the passes before it.
bool ProgressiveRender::lateForEdit(const RenderRequest& request) const {
  return unfinished_ && small_ && firstOfEdit(request) && divisor_ < kMostDivisor &&
         passSeconds_ >= std::chrono::duration<double>(options_.tooLate).count();
}

/// Whether somebody waits for the first picture that has an edit in it.
bool ProgressiveRender::firstOfEdit(const RenderRequest& request) const {
  return request.interactive && shown_.revision != request.revision;
}

bool ProgressiveRender::finished(const RenderRequest& request) const {
  return stopMet(request.scene->stop, *renderer_, filmSeconds_);
}

/// Whether the film as it stands is worth a frame.
bool ProgressiveRender::showDue(const RenderRequest& request) const {
  const std::uint32_t samples = renderer_->samples();
  if (samples == 0) return false;
  if (shown_.revision != revision_ || shown_.interactive != request.interactive) return true;
  if (shown_.mixed && !request.pollSamples.empty()) return true;
  if (!request.interactive && divisor_ == 1 && finished(request)) return !shown_.final;
  if (samples == shown_.samples) return false;
  if (std::any_of(request.pollSamples.begin(), request.pollSamples.end(),
                  [&](std::uint32_t wanted) { return shown_.samples < wanted && wanted <= samples; }))
    return true;
  return std::has_single_bit(samples) ||
         now_() - shownAt_ >= (request.interactive ? options_.interactiveInterval : options_.stillInterval);
}

ProgressiveRender::Work ProgressiveRender::work() const {
  const RenderRequest request = session_->request();
  if (!request.wanted || !(sceneStale(request) || !finished(request) || showDue(request))) return Work::none;
  return firstOfEdit(request) ? Work::urgent : request.interactive ? Work::refine : Work::still;
}

bool ProgressiveRender::edited() const {
  const RenderRequest request = session_->request();
  return request.wanted && request.interactive;
}

std::optional<TimePoint> ProgressiveRender::dueAt() const {
  const RenderRequest request = session_->request();
  if (!request.wanted) return std::nullopt;
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
    double seconds = std::chrono::duration<double>(options_.frameTarget).count(), divisor = 1;
    do divisor = divisorForTarget(pixels, *known, seconds *= options_.restFactor);
    while (divisor > 1 && reducedShown && divisor >= divisor_);
    return divisor;
  }
  // All that are edited together have two targets a round, so that the picture stays sharp when they are few.
  const auto target =
      std::max(2 * options_.frameTarget / std::max(2, 1 + editedOthers), options_.leastTarget);
  return divisorForTarget(pixels, *known, std::chrono::duration<double>(target).count(), interactiveDivisor_);
}

std::uint64_t ProgressiveRender::filmSize() const {
  const Scene scene = atDivisor(scene_->render, divisor_);
  return std::uint64_t(scene.width) * std::uint64_t(scene.height);
}

/// A pass that is given up has cost as much as it had until then; how much was missing is not known: say
/// half.
void ProgressiveRender::learnFromUnfinished() {
  if (!unfinished_ || !scene_) return;
  auto& known = secondsPerPixel_[small_];
  known = std::max(known.value_or(0), 2 * passSeconds_ / double(filmSize()));
}

void ProgressiveRender::takeScene(const RenderRequest& request, const Others& others, PassResult& result) {
  const TimePoint begin = now_();
  if (small_) learnFromUnfinished();
  if (!renderer_ || volume_ != request.scene->dataset->volume) {
    renderer_.reset();
    volume_ = request.scene->dataset->volume;
    renderer_ = makeRenderer_(volume_);
    recording_ = false;
    secondsPerPixel_[false].reset();
    secondsPerPixel_[true].reset();
    interactiveDivisor_ = 0;
  }
  const double divisor = wantedDivisor(request, others.edited);
  const Scene scene = drawnScene(*request.scene, divisor, request.interactive);
  // What is recorded of AOVs takes up to twice as much again, with all channels there may be.
  const auto pixels = std::uint64_t(scene.width) * std::uint64_t(scene.height) * (request.aovs ? 3 : 1);
  if (pixels > filmPixels_ && others.filmPixels + pixels > options_.filmPixels)
    throw Error(ErrorCode::tooLarge, "image: all sessions together may have " +
                                         std::to_string(options_.filmPixels) + " pixels, " +
                                         std::to_string(others.filmPixels) + " of them are taken");
  RebuildStats stats = renderer_->setScene(scene);
  if (request.aovs && !recording_) {
    renderer_->recordAovs();
    recording_ = stats.filmReset = true;
    shown_ = {};  // the frames so far do not count: they hold no AOVs
  }
  filmPixels_ = pixels;
  abandoned_ = unfinished_;
  unfinished_ = false;
  if (stats.filmReset) filmSeconds_ = 0;
  if (request.interactive || revision_ != request.revision) reduced_.reset();
  scene_ = request.scene;
  revision_ = request.revision;
  divisor_ = divisor;
  small_ = request.interactive;
  restShown_ = false;
  if (small_ && (secondsPerPixel_[false] || secondsPerPixel_[true])) interactiveDivisor_ = divisor;
  result.rebuildSeconds = secondsBetween(begin, now_());
  rebuildUs_ = microseconds(result.rebuildSeconds);
}

void ProgressiveRender::addSample(bool urgent, bool othersUrgent, PassResult& result) {
  const TimePoint begin = now_();
  if (!unfinished_) passBegan_ = begin, passSeconds_ = 0;
  // The turn between two urgent ones is short, and its own: however fast edits come, it gets on.
  const bool whole = urgent || othersUrgent;
  const auto slice = urgent ? options_.tooLate : othersUrgent ? options_.politeSlice : options_.slice;
  result.rendered = renderer_->renderSample(whole ? kNever : interrupted_, slice);
  result.cancelled = !result.rendered && !whole && interrupted_;
  passSeconds_ += secondsBetween(begin, now_());
  unfinished_ = !result.rendered;
  if (!result.rendered) return;
  abandoned_ = false;
  result.renderSeconds = passSeconds_;
  result.pixels = filmSize();
  filmSeconds_ += result.renderSeconds;
  renderUs_ = microseconds(result.renderSeconds);
  const double perPixel = result.renderSeconds / double(result.pixels);
  auto& known = secondsPerPixel_[small_];
  known = known ? 0.5 * (*known + perPixel) : perPixel;
}

/// Mixes the reduced picture that is on screen into the one that takes its place; whether there was one.
bool ProgressiveRender::mix(Image* image) {
  if (!reduced_) return false;
  const double error = renderer_->samples() > 1 ? renderer_->estimatedError() : sampleError_;
  const double share = mixIn(enlarged(*reduced_, image->width, image->height), error, image);
  if (share > 0.98) reduced_.reset();
  return true;
}

void ProgressiveRender::show(const RenderRequest& request) {
  FrameInfo info;
  info.revision = revision_;
  info.samples = renderer_->samples();
  info.method = renderer_->choice().method;
  info.error = float(renderer_->estimatedError());
  info.rebuildUs = rebuildUs_;
  info.renderUs = renderUs_;
  info.reduced = divisor_ != 1;
  info.interactive = request.interactive || info.reduced;
  info.final = !info.interactive && finished(request);
  Image picture = renderer_->image();
  if (!request.interactive && !info.final && request.pollSamples.empty()) info.mixed = mix(&picture);
  auto image = std::make_shared<const Image>(std::move(picture));
  if (info.reduced) {
    reduced_ = image;
    if (request.interactive) sampleError_ = info.samples > 1 ? info.error * std::sqrt(info.samples) : 0;
  }
  restShown_ = !request.interactive;
  RenderedFrame frame{info, std::move(image), scene_->render.background, {}};
  if (recording_ && !request.interactive) {
    std::vector<AovValues> aovs;
    for (std::size_t i = 0; i < std::size(kAovs); ++i) aovs.push_back(renderer_->aov(Aov(i)));
    frame.aovs = std::make_shared<const std::vector<AovValues>>(std::move(aovs));
  }
  session_->submit(std::move(frame));
  shown_ = info;
  shownAt_ = now_();
}

PassResult ProgressiveRender::run(const Others& others) {
  PassResult result;
  const RenderRequest request = session_->request();
  if (!request.wanted) return result;
  try {
    if ((sceneStale(request) && !keepsPass(request)) || lateForEdit(request))
      takeScene(request, others, result);
    if (!finished(request)) addSample(firstOfEdit(request), others.urgent, result);
    if (!unfinished_ && showDue(request)) show(request);
    return result;
  } catch (const Error& error) {
    session_->fail(request.revision, error.what());
  } catch (const std::bad_alloc&) {
    session_->fail(request.revision, "not enough memory to render this scene");
  } catch (const std::exception& error) {
    log_(std::string("session ") + session_->id() + ": the renderer failed: " + error.what());
    session_->fail(request.revision, "the renderer failed");  // the cause is not for a client
  }
  // What an error has left behind is not worth keeping.
  scene_.reset();
  renderer_.reset();
  filmPixels_ = 0;
  unfinished_ = false;
  return result;
}

}  // namespace scolopax::server
