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

}  // namespace

ProgressiveRender::ProgressiveRender(std::shared_ptr<Session> session, const RenderContext& context,
                                     PassInterrupter& interrupter)
    : session_(std::move(session)),
      context_(context),
      interrupter_(interrupter),
      pick_(*session_, context, interrupter),
      resolution_(context.policy) {}

ProgressiveRender::~ProgressiveRender() {
  endTask();
  unpark();
  dropRenderer();
}

void ProgressiveRender::endTask() {
  if (job_) job_->cancel();
  job_.reset();
  task_ = {};
}

/// Done in the background, because releasing the memory of a large film takes time.
void ProgressiveRender::dropRenderer() {
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
  context_.parked->park(this, {std::exchange(renderer_, nullptr), std::exchange(volume_, nullptr)});
  parked_ = true;
}

void ProgressiveRender::unpark() {
  if (!std::exchange(parked_, false)) return;
  auto [renderer, volume] = context_.parked->take(this);
  renderer_ = std::move(renderer);
  volume_ = std::move(volume);
  if (!renderer_) dropRenderer();
}

/// Until an edit has been shown, speed counts more than quality. If its picture is late because of other
/// sessions' turns, a finer one would be much later.
RenderRequest ProgressiveRender::request() const {
  RenderRequest request = session_->request();
  if (film_.shown.revision < request.edit) request.interactive = true;
  return request;
}

/// Whether there is a pick that can go on or begin. It begins when the renderer has a scene that is new
/// enough and is not building another one.
bool ProgressiveRender::pickReady(const RenderRequest& request) const {
  if (!request.pick) return false;
  if (pick_.has(request.pick->id)) return !pick_.busy();
  return film_.scene && !building() && film_.revision >= request.pick->revision;
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
  if (!request.pictures) return Step::none;
  if (!finished(request)) return Step::addSample;
  return showDue(request) ? Step::show : Step::none;
}

ProgressiveRender::Urgency ProgressiveRender::urgency() const {
  const RenderRequest request = this->request();
  if (pickReady(request)) return Urgency::urgent;
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
  const auto picture = pictureDueAt(), pick = pick_.dueAt();
  return picture && pick ? std::min(*picture, *pick) : picture ? picture : pick;
}

std::optional<TimePoint> ProgressiveRender::pictureDueAt() const {
  if (job_) return std::nullopt;  // its end wakes the loop
  const RenderRequest request = this->request();
  if (!request.wanted || request.retryAt) return request.retryAt;
  // The end may have passed between urgency() and here. Then the turn is due at once.
  if (request.pictures && (request.interactive || film_.shown.interactive)) return request.interactiveEnd;
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

template <class T>
void ProgressiveRender::perform(Background* background, std::shared_ptr<T> task, PassResult& result) {
  task_ = task;
  if (!background) {
    task->run(std::stop_token());
    return taskDone(result);
  }
  job_ = background->start(
      session_->id(), [task](const std::stop_token& stop) { task->run(stop); }, context_.wake);
  if (job_->done()) collect(result);
}

void ProgressiveRender::collect(PassResult& result) {
  const auto job = std::exchange(job_, nullptr);
  try {
    job->rethrow();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    result.abandoned = building();
    task_ = {};
    return;
  }
  taskDone(result);
}

void ProgressiveRender::taskDone(PassResult& result) {
  const Task task = std::exchange(task_, {});
  std::visit([&](const auto& done) { ended(done, result); }, task);
}

bool ProgressiveRender::taskUseless(const RenderRequest& request) const {
  if (const auto* build = std::get_if<std::shared_ptr<SceneBuild>>(&task_))
    return !request.wanted || (*build)->uselessFor(request);
  if (!request.pictures) return true;
  if (std::holds_alternative<std::shared_ptr<RenderPart>>(task_))
    return film_.stale(request) && !film_.shieldsPass(request, context_.policy, context_.now());
  return std::holds_alternative<std::shared_ptr<PictureJob>>(task_) && film_.stale(request);
}

void ProgressiveRender::supervise() {
  pick_.supervise();
  const RenderRequest request = this->request();
  if (!job_ && renderer_ && !request.wanted) park();
  if (job_ && !job_->done() && taskUseless(request)) job_->cancel();
}

void ProgressiveRender::buildScene(const RenderRequest& request, const OtherSessions& others,
                                   PassResult& result) {
  if (film_.begunInteractive && film_.unfinished && film_.scene)
    resolution_.passGivenUp(true, filmSize(), film_.passSeconds);
  if (dataset_ != request.scene->dataset) resolution_.forget();  // another time costs the same
  const auto build = std::make_shared<SceneBuild>();
  if (dataset_ != request.scene->dataset || time_ != request.scene->time) {
    build->previous = std::exchange(renderer_, nullptr);
    dropRenderer();
  }
  if (film_.recording && !request.aovs) dropRenderer();  // to release the memory of the records
  dataset_ = request.scene->dataset;
  time_ = request.scene->time;
  film_.abandoned = film_.unfinished;
  film_.unfinished = false;
  build->request = request;
  build->begin = context_.now();
  build->divisor = wantedDivisor(request, others.edited);
  build->scene = drawnScene(*request.scene, build->divisor, request.interactive);
  build->record = request.aovs && !film_.recording;
  build->volume = volume_;
  build->renderer = renderer_;
  build->make = context_.makeRenderer;
  // Recording begins by clearing a lot of memory.
  build->inBackground = !renderer_ || build->record || renderer_->takesLong(build->scene);
  Scene chosen = build->scene;
  if (chosen.method == Method::automatic) chosen.method = Method::hybrid;
  build->onlyChooses = build->inBackground && renderer_ && !build->record && !renderer_->takesLong(chosen);
  perform(build->inBackground ? &context_.builds : nullptr, build, result);
}

void ProgressiveRender::ended(const std::shared_ptr<SceneBuild>& build, PassResult& result) {
  const RenderRequest& request = build->request;
  const bool otherData = volume_ != build->volume;
  volume_ = build->volume;
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
  if (otherData && context_.prefetch) context_.prefetch->around(dataset_, time_, build->scene.macrocell);
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
  // A pick that goes on in the background does not wait for this pass.
  const bool urgent = film_.firstOfEdit(request),
             othersWait = others.urgent || (request.pick && !pick_.busy());
  const RenderPolicy& policy = context_.policy;
  const auto slice = urgent ? urgentSlice(others.edited) : othersWait ? policy.politeSlice : policy.slice;
  const TimePoint begin = context_.now();
  if (!film_.unfinished) film_.passBegan = begin, film_.passSeconds = 0;
  const auto render = [renderer = renderer_](const std::atomic<bool>& cancel,
                                             std::chrono::nanoseconds budget) {
    return renderer->renderPixels(cancel, budget);
  };
  const auto part = std::make_shared<RenderPart>(render, slice, context_.now);
  // Not known to be quick: what takes long must not delay those at which edits arrive.
  if (begin < slowUntil_ || (!quick_ && others.edited > 0)) return perform(&context_.passes, part, result);
  // A turn between two urgent ones is short but not interrupted, so that it makes progress however fast edits
  // arrive.
  part->run(interrupter_, urgent || othersWait);
  ended(part, result);
}

void ProgressiveRender::ended(const std::shared_ptr<RenderPart>& part, PassResult& result) {
  const bool slow = part->hasSlowRays();
  if (slow) slowUntil_ = context_.now() + RenderPart::kSlowTime;
  quick_ = !slow;
  result.cancelled = part->interrupted() && !slow;
  film_.passSeconds += part->seconds();
  film_.unfinished = !part->complete();
  if (!part->complete()) return;
  const auto addition =
      std::make_shared<SampleAddition>(SampleAddition{renderer_, film_.scene->stop.error > 0});
  perform(renderer_->filmIsLarge() ? &context_.pictures : nullptr, addition, result);
}

void ProgressiveRender::ended(const std::shared_ptr<SampleAddition>&, PassResult& result) {
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
  const auto picture = std::make_shared<PictureJob>();
  picture->renderer = renderer_;
  picture->pixels = filmSize();
  picture->memory = context_.memory;
  FrameInfo& info = picture->frame.info;
  info.revision = film_.revision;
  info.samples = renderer_->samples();
  info.method = renderer_->choice().method;
  info.rebuildUs = rebuildUs_;
  info.renderUs = renderUs_;
  info.reduced = film_.divisor != 1;
  info.interactive = request.interactive || info.reduced;
  info.final = !info.interactive && finished(request);
  picture->frame.background = film_.scene->render.background;
  picture->interactive = request.interactive;
  picture->aovs = film_.recording && !request.interactive;
  // The reduced picture on the screen is blended into the picture that replaces it.
  if (!request.interactive && !info.final && request.pollSamples.empty()) picture->reduced = reduced_;
  picture->sampleError = sampleError_;
  Background* const background = renderer_->errorTakesLong() ? &context_.errors
                                 : renderer_->filmIsLarge()  ? &context_.pictures
                                                             : nullptr;
  perform(background, picture, result);
}

void ProgressiveRender::ended(const std::shared_ptr<PictureJob>& picture, PassResult&) {
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

/// Gives the turn to a pick, if there is one that can go on. Picks and pictures take turns.
bool ProgressiveRender::pickIn(const RenderRequest& request) {
  pickedLast_ = pickReady(request) && !(pickedLast_ && request.pictures);
  if (pickedLast_) pick_.run(*request.pick, film_.scene, film_.revision, volume_, renderer_);
  return pickedLast_;
}

void ProgressiveRender::turn(const RenderRequest& request, const OtherSessions& others, PassResult& result) {
  if (request.wanted) unpark();
  if (pickIn(request)) return;
  if (job_ && !job_->done()) return;
  const bool collected = job_ != nullptr;
  const bool built = building();
  if (collected) collect(result);
  if (!request.wanted || job_) return;
  // A pick begins before the next build or pass, so that it need not wait for it.
  if (built && pickIn(request)) return;
  Step next = step(request);
  if (next == Step::buildScene) {
    buildScene(request, others, result);
    if (job_ || !film_.scene || pickIn(request)) return;
    next = step(request);
  }
  if (next == Step::none) return;
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
  const auto* build = std::get_if<std::shared_ptr<SceneBuild>>(&task_);
  const std::uint32_t revision = build         ? (*build)->request.revision
                                 : film_.scene ? film_.revision
                                               : request.revision;
  session_->fail(revision, error);
  // The state after an error cannot be trusted.
  endTask();
  dropRenderer();
}

}  // namespace scolopax::server
