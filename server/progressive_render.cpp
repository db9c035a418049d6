// SPDX-License-Identifier: Apache-2.0
#include "server/progressive_render.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "renderer/core/error.h"
#include "server/render_jobs.h"
#include "server/stop_rule.h"

namespace scolopax::server {
namespace {

double secondsBetween(TimePoint from, TimePoint to) {
  return std::chrono::duration<double>(to - from).count();
}

std::uint32_t microseconds(double seconds) { return std::uint32_t(std::clamp(seconds * 1e6, 0.0, 4e9)); }

/// If a part of a pass exceeds its slice by this time, single rays take that long. On a busy machine, any
/// part may exceed it a little.
constexpr std::chrono::milliseconds kSlowRay{300};
/// Time for which passes are then rendered in the background, where they delay no other session.
constexpr std::chrono::seconds kSlowTime{10};

}  // namespace

ProgressiveRender::ProgressiveRender(std::shared_ptr<Session> session, const RenderContext& context,
                                     PassInterrupter& interrupter)
    : session_(std::move(session)),
      context_(context),
      interrupter_(interrupter),
      resolution_(context.policy) {}

ProgressiveRender::~ProgressiveRender() {
  if (job_) job_->cancel();
  unpark();
  dropRenderer();
}

/// Done in the background, because releasing the memory of a large film takes time.
void ProgressiveRender::dropRenderer() {
  pick_.forget();
  film_.scene.reset();
  volume_.reset();
  quick_ = false;
  film_.recording = film_.unfinished = false;
  if (!renderer_) return;
  context_.pictures.start(
      session_->id(), [last = std::move(renderer_)](const std::stop_token&) {}, [] {});
  renderer_.reset();
}

void ProgressiveRender::park() {
  pick_.forget();
  context_.parked->park(this, std::move(renderer_));
  renderer_.reset();
  parked_ = true;
}

void ProgressiveRender::unpark() {
  if (!std::exchange(parked_, false)) return;
  renderer_ = context_.parked->take(this);
  if (!renderer_) dropRenderer();
}

/// Until an edit has been shown, speed counts more than quality. If its picture is late because of other
/// sessions' turns, a finer one would be much later.
RenderRequest ProgressiveRender::request() const {
  RenderRequest request = session_->request();
  if (film_.shown.revision < request.edit) request.interactive = true;
  return request;
}

/// Whether there is a pick, and the renderer has its scene and is not building another one.
bool ProgressiveRender::pickable(const RenderRequest& request) const {
  return request.pick && film_.scene && !build_ && film_.revision == request.revision;
}

bool ProgressiveRender::finished(const RenderRequest& request) const {
  return stopMet(request.scene->stop, *renderer_, filmSeconds_);
}

bool ProgressiveRender::showDue(const RenderRequest& request) const {
  return film_.showDue(request, {renderer_->samples(), finished(request)}, context_.policy, context_.now());
}

ProgressiveRender::Step ProgressiveRender::step(const RenderRequest& request) const {
  if (!request.wanted) return Step::none;
  if ((film_.stale(request) && !film_.shieldsPass(request, context_.policy, context_.now())) ||
      film_.lateForEdit(request, context_.policy))
    return Step::buildScene;
  if (!finished(request)) return Step::addSample;
  return showDue(request) ? Step::show : Step::none;
}

ProgressiveRender::Urgency ProgressiveRender::urgency() const {
  const RenderRequest request = this->request();
  if (pickable(request)) return Urgency::urgent;
  const Urgency toShow = film_.firstOfEdit(request) ? Urgency::urgent : Urgency::atRest;
  if (parked_) return request.wanted ? toShow : Urgency::none;
  if (job_) return job_->done() ? toShow : Urgency::none;
  if (step(request) == Step::none) return Urgency::none;
  return request.interactive && toShow != Urgency::urgent ? Urgency::refine : toShow;
}

bool ProgressiveRender::edited() const {
  const RenderRequest request = this->request();
  return request.wanted && request.interactive;
}

std::optional<TimePoint> ProgressiveRender::dueAt() const {
  if (job_) return std::nullopt;  // its end wakes the loop
  const RenderRequest request = this->request();
  if (!request.wanted || request.retryAt) return request.retryAt;
  // The end may have passed between urgency() and here. Then the turn is due at once.
  if (request.interactive || film_.shown.interactive) return request.interactiveEnd;
  return std::nullopt;
}

/// Whether the film is one of the requested scene, though maybe of another size.
bool ProgressiveRender::filmGoesOn(const RenderRequest& request) const {
  return film_.scene && makeSameFilm(*film_.scene, *request.scene);
}

double ProgressiveRender::wantedDivisor(const RenderRequest& request, int editedOthers) {
  const Scene& scene = request.scene->render;
  const auto pixels = std::uint64_t(scene.width) * std::uint64_t(scene.height);
  if (request.interactive) return resolution_.whileEdited(pixels, editedOthers);
  const bool goesOn = filmGoesOn(request);
  if (goesOn && film_.divisor == 1) return 1;
  const bool shown =
      film_.shown.revision == request.revision || (goesOn && film_.shown.revision == film_.revision);
  const bool reducedShown = shown && film_.shown.reduced;
  if (!request.pollSamples.empty() || (shown && !reducedShown)) return 1;
  return resolution_.atRest(pixels, reducedShown ? std::optional(film_.divisor) : std::nullopt);
}

std::uint64_t ProgressiveRender::filmSize() const {
  const Scene scene = atDivisor(film_.scene->render, film_.divisor);
  return std::uint64_t(scene.width) * std::uint64_t(scene.height);
}

void ProgressiveRender::perform(Background* background, Background::Work work, Next next,
                                PassResult& result) {
  if (!background) {
    work({});
    (this->*next)(result);
    return;
  }
  next_ = next;
  job_ = background->start(session_->id(), std::move(work), context_.wake);
  if (job_->done()) collect(result);
}

void ProgressiveRender::collect(PassResult& result) {
  const auto job = std::exchange(job_, nullptr);
  try {
    job->rethrow();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    result.abandoned = build_ != nullptr;
    build_.reset();
    part_.reset();
    picture_.reset();
    return;
  }
  (this->*next_)(result);
}

void ProgressiveRender::supervise() {
  const RenderRequest request = this->request();
  if (!job_ && renderer_ && !request.wanted) park();
  if (!job_ || job_->done()) return;
  const bool useless =
      build_  ? build_->uselessFor(request)
      : part_ ? film_.stale(request) && !film_.shieldsPass(request, context_.policy, context_.now())
              : picture_ && film_.stale(request);
  if (!request.wanted || useless) job_->cancel();
}

void ProgressiveRender::buildScene(const RenderRequest& request, const OtherSessions& others,
                                   PassResult& result) {
  pick_.forget();
  if (film_.begunInteractive && film_.unfinished && film_.scene)
    resolution_.passGivenUp(true, filmSize(), film_.passSeconds);
  const auto volume = request.scene->dataset->volume;
  if (volume_ != volume) {
    dropRenderer();
    resolution_.forget();
  }
  if (film_.recording && !request.aovs) dropRenderer();  // to release the memory of the records
  volume_ = volume;
  film_.abandoned = film_.unfinished;
  film_.unfinished = false;
  build_ = std::make_shared<SceneBuild>();
  build_->request = request;
  build_->begin = context_.now();
  build_->divisor = wantedDivisor(request, others.edited);
  build_->scene = drawnScene(*request.scene, build_->divisor, request.interactive);
  build_->record = request.aovs && !film_.recording;
  build_->renderer = renderer_;
  // Recording begins by clearing a lot of memory.
  build_->inBackground = !renderer_ || build_->record || renderer_->takesLong(build_->scene);
  Scene chosen = build_->scene;
  if (chosen.method == Method::automatic) chosen.method = Method::hybrid;
  build_->onlyChooses = build_->inBackground && renderer_ && !build_->record && !renderer_->takesLong(chosen);
  const auto setScene = [build = build_, volume, make = context_.makeRenderer](const std::stop_token& stop) {
    if (!build->renderer) build->renderer = make(volume);
    build->stats = build->renderer->setScene(build->scene, stop);
    if (build->record) build->renderer->recordAovs();
  };
  perform(build_->inBackground ? &context_.builds : nullptr, setScene, &ProgressiveRender::sceneBuilt,
          result);
}

void ProgressiveRender::sceneBuilt(PassResult& result) {
  const auto build = std::exchange(build_, nullptr);
  const RenderRequest& request = build->request;
  renderer_ = build->renderer;
  if (build->record) {
    film_.recording = true;
    film_.shown = {};  // earlier frames do not count, since they have no AOVs
  }
  if (build->stats.filmReset || build->record) filmSeconds_ = 0;
  if (request.interactive || !filmGoesOn(request)) reduced_.reset();
  film_.scene = request.scene;
  film_.revision = request.revision;
  film_.divisor = build->divisor;
  film_.begunInteractive = request.interactive;
  film_.restShown = false;
  result.built = build->inBackground;
  result.rebuildSeconds = secondsBetween(build->begin, context_.now());
  rebuildUs_ = microseconds(result.rebuildSeconds);
}

/// The longest turn of a first picture after an edit. While other sessions are edited, too, this pass gets
/// its planned time once and then short turns until it is complete, so that the others' first pictures are
/// not delayed.
std::chrono::microseconds ProgressiveRender::urgentSlice(int editedOthers) const {
  constexpr double kMargin = 1.5;  // so that a pass that takes the planned time needs a single turn
  const RenderPolicy& policy = context_.policy;
  if (editedOthers == 0) return policy.tooLate;
  if (film_.unfinished || film_.abandoned) return policy.politeSlice;
  return std::chrono::duration_cast<std::chrono::microseconds>(kMargin * targetOfPass(policy, editedOthers));
}

void ProgressiveRender::addSample(const RenderRequest& request, const OtherSessions& others,
                                  PassResult& result) {
  const bool urgent = film_.firstOfEdit(request), othersWait = others.urgent || request.pick;
  const RenderPolicy& policy = context_.policy;
  const auto slice = urgent ? urgentSlice(others.edited) : othersWait ? policy.politeSlice : policy.slice;
  const TimePoint begin = context_.now();
  if (!film_.unfinished) film_.passBegan = begin, film_.passSeconds = 0;
  part_ = std::make_shared<PassPart>();
  part_->slice = slice;
  // Not known to be quick: what takes long must not delay those at which edits arrive.
  part_->inBackground = begin < slowUntil_ || (!quick_ && others.edited > 0);
  if (part_->inBackground) {
    const auto render = [part = part_, renderer = renderer_, now = context_.now](
                            const std::stop_token& stop) { part->render(*renderer, now, stop); };
    perform(&context_.passes, render, &ProgressiveRender::partRendered, result);
    return;
  }
  const auto render = [&](const std::stop_token&) {
    const PassInterrupter::Watched watched(interrupter_, begin + slice + kSlowRay);
    // A turn between two urgent ones is short but not interrupted, so that it makes progress however fast
    // edits arrive.
    part_->render(*renderer_, context_.now, interrupter_.flag(urgent || othersWait));
  };
  perform(nullptr, render, &ProgressiveRender::partRendered, result);
}

void ProgressiveRender::partRendered(PassResult& result) {
  const auto part = std::exchange(part_, nullptr);
  const bool slow = part->seconds >= std::chrono::duration<double>(part->slice + kSlowRay).count();
  if (slow) slowUntil_ = context_.now() + kSlowTime;
  quick_ = !slow;
  result.cancelled = part->interrupted && !slow;
  film_.passSeconds += part->seconds;
  film_.unfinished = !part->complete;
  if (!part->complete) return;
  const auto add = [renderer = renderer_, estimate = film_.scene->stop.error > 0](const std::stop_token&) {
    renderer->addPixels();
    // Makes the error known when it is needed. If estimating it takes long, show() does it.
    if (estimate && !renderer->errorTakesLong()) renderer->estimatedError();
  };
  perform(renderer_->filmIsLarge() ? &context_.pictures : nullptr, add, &ProgressiveRender::sampleAdded,
          result);
}

void ProgressiveRender::sampleAdded(PassResult& result) {
  film_.abandoned = false;
  result.rendered = true;
  result.renderSeconds = film_.passSeconds;
  result.pixels = filmSize();
  filmSeconds_ += result.renderSeconds;
  renderUs_ = microseconds(result.renderSeconds);
  resolution_.passDone(film_.begunInteractive, result.pixels, result.renderSeconds);
}

void ProgressiveRender::show(const RenderRequest& request, PassResult& result) {
  film_.shownFailures = request.failures;
  film_.shownDrops = request.drops;
  picture_ = std::make_shared<PictureJob>();
  FrameInfo& info = picture_->frame.info;
  info.revision = film_.revision;
  info.samples = renderer_->samples();
  info.method = renderer_->choice().method;
  info.rebuildUs = rebuildUs_;
  info.renderUs = renderUs_;
  info.reduced = film_.divisor != 1;
  info.interactive = request.interactive || info.reduced;
  info.final = !info.interactive && finished(request);
  picture_->frame.background = film_.scene->render.background;
  picture_->interactive = request.interactive;
  picture_->aovs = film_.recording && !request.interactive;
  // The reduced picture on the screen is blended into the picture that replaces it.
  if (!request.interactive && !info.final && request.pollSamples.empty()) picture_->reduced = reduced_;
  picture_->sampleError = sampleError_;
  const auto make = [picture = picture_, renderer = renderer_, pixels = filmSize(), memory = context_.memory](
                        const std::stop_token& stop) { picture->make(*renderer, pixels, memory, stop); };
  Background* const background = renderer_->errorTakesLong() ? &context_.errors
                                 : renderer_->filmIsLarge()  ? &context_.pictures
                                                             : nullptr;
  perform(background, make, &ProgressiveRender::pictureMade, result);
}

void ProgressiveRender::pictureMade(PassResult&) {
  const auto picture = std::exchange(picture_, nullptr);
  const FrameInfo& info = picture->frame.info;
  if (info.mixed && picture->share > 0.98) reduced_.reset();
  if (info.reduced) {
    reduced_ = picture->frame.image;
    if (picture->interactive)
      sampleError_ =
          info.samples < 2 || std::isnan(info.error) ? 0 : double(info.error) * std::sqrt(info.samples);
  }
  film_.restShown = !picture->interactive;
  film_.shown = info;
  film_.shownAt = context_.now();
  session_->submit(std::move(picture->frame));
}

/// Runs a slice of a pick if there is one and the last turn was not a pick's.
bool ProgressiveRender::pickIn(const RenderRequest& request) {
  pickedLast_ = pickable(request) && !pickedLast_;
  if (pickedLast_)
    pick_.run(*request.pick, *request.scene, film_.revision, *renderer_, context_.policy.politeSlice,
              *session_, context_.log);
  return pickedLast_;
}

void ProgressiveRender::turn(const RenderRequest& request, const OtherSessions& others, PassResult& result) {
  if (request.wanted) unpark();
  if (pickIn(request)) return;
  if (job_ && !job_->done()) return;
  const bool collected = job_ != nullptr;
  bool built = build_ != nullptr;
  if (collected) collect(result);
  if (!request.wanted || job_) return;
  Step next = step(request);
  if (next == Step::buildScene) {
    buildScene(request, others, result);
    if (job_ || !film_.scene) return;
    built = true;
    next = step(request);
  }
  if (built && pickIn(request)) return;  // so that the pick does not wait for a pass
  const auto mayShow = [&] { return !job_ && !film_.unfinished && showDue(request); };
  // A sample added in the background is shown before the next pass begins.
  if (collected && mayShow()) return show(request, result);
  if (next == Step::addSample) addSample(request, others, result);
  if (mayShow()) show(request, result);
}

PassResult ProgressiveRender::run(const OtherSessions& others) {
  PassResult result;
  const RenderRequest request = this->request();
  try {
    turn(request, others, result);
    return result;
  } catch (const Error& error) {
    fail(request, error);
  } catch (const std::bad_alloc&) {
    fail(request, Error(ErrorCode::tooLarge, "not enough memory to render this scene"));
  } catch (const std::exception& error) {
    context_.log(std::string("session ") + session_->id() + ": the renderer failed: " + error.what());
    fail(request, Error(ErrorCode::unsupported, "the renderer failed"));  // clients must not see the cause
  }
  return result;
}

void ProgressiveRender::fail(const RenderRequest& request, const Error& error) {
  // The failure may concern a scene that an edit has replaced in the meantime.
  const std::uint32_t revision = build_        ? build_->request.revision
                                 : film_.scene ? film_.revision
                                               : request.revision;
  session_->fail(revision, error);
  // The state after an error cannot be trusted.
  if (job_) job_->cancel();
  job_.reset();
  next_ = nullptr;
  build_.reset();
  part_.reset();
  picture_.reset();
  dropRenderer();
}

}  // namespace scolopax::server
