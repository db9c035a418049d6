// SPDX-License-Identifier: Apache-2.0
#include "server/render_loop.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/data/film.h"
#include "server/encoder.h"

namespace scolopax::server {
namespace {

void keepEarlier(std::optional<TimePoint>& a, const std::optional<TimePoint>& b) {
  if (b) a = a ? std::min(*a, *b) : *b;
}

}  // namespace

RenderLoop::RenderLoop(SessionStore& store, RenderContext context, OnPass onPass)
    : store_(store),
      context_(std::move(context)),
      onPass_(std::move(onPass)),
      interrupter_(context_.now, context_.wakeWatch) {
  if (context_.volumes)
    context_.volumes->setResting({
        .volumes =
            [kept = std::weak_ptr(context_.parked)] {
              const auto parked = kept.lock();
              return parked ? parked->volumes() : std::vector<const Volume*>{};
            },
        .release =
            [kept = std::weak_ptr(context_.parked)] {
              const auto parked = kept.lock();
              return parked && parked->dropOldest();
            },
    });
  if (!context_.memory) return;
  // Pictures first, because they can be made again from the films.
  context_.memory->setRelease([dropPicture = store_.pictureRelease(), kept = std::weak_ptr(context_.parked)] {
    if (dropPicture()) return true;
    const auto parked = kept.lock();
    return parked && parked->dropOldest();
  });
}

void RenderLoop::followStore() {
  const auto sessions = store_.all();
  const auto known = [&](const std::shared_ptr<Session>& session) {
    return std::any_of(renders_.begin(), renders_.end(),
                       [&](const auto& r) { return r->session() == session; });
  };
  std::erase_if(renders_, [&](const auto& render) {
    return std::find(sessions.begin(), sessions.end(), render->session()) == sessions.end();
  });
  for (const auto& session : sessions)
    if (!known(session))
      renders_.push_back(std::make_unique<ProgressiveRender>(session, context_, interrupter_));
}

RenderLoop::Renders::iterator RenderLoop::nextTurn() {
  using Urgency = ProgressiveRender::Urgency;
  auto urgent = renders_.end(), atRest = renders_.end(), any = renders_.end();
  int urgentCount = 0;
  for (auto render = renders_.begin(); render != renders_.end(); ++render) {
    const Urgency urgency = (*render)->urgency();
    if (urgency == Urgency::none) continue;
    if (any == renders_.end()) any = render;
    if (urgency == Urgency::atRest && atRest == renders_.end()) atRest = render;
    if (urgency == Urgency::urgent && urgentCount++ == 0) urgent = render;
  }
  const bool turnOfAtRest = lastUrgent_ && atRest != renders_.end();
  const auto turn = urgentCount == 0 ? any : turnOfAtRest ? atRest : urgent;
  lastUrgent_ = urgentCount > 0 && turn == urgent;
  othersUrgent_ = urgentCount > 0 && turn != urgent;
  return turn;
}

std::optional<TimePoint> RenderLoop::step() {
  std::optional<TimePoint> next = store_.expire();
  followStore();
  for (const auto& render : renders_) render->supervise();
  interrupter_.reset();  // edits from here on interrupt the pass; earlier ones are seen by nextTurn()
  const auto turn = nextTurn();
  if (turn != renders_.end()) {
    // Moved behind all others before it runs, so that a session with slow passes also gets only one turn per
    // round.
    std::rotate(turn, turn + 1, renders_.end());
    ProgressiveRender::OtherSessions others;
    others.urgent = othersUrgent_;
    for (const auto& render : renders_) {
      if (render == renders_.back()) continue;
      others.edited += render->edited();
    }
    onPass_(renders_.back()->run(others));
    return context_.now();
  }
  for (const auto& render : renders_) keepEarlier(next, render->dueAt());
  return next;
}

EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now,
                         const std::shared_ptr<MemoryBudget>& memory) {
  const TimePoint begin = now();
  const Image& image = *rendered.image;
  // A reduced picture has few bytes, and enlarging it would make compression artefacts visible.
  const int quality = rendered.info.reduced ? 95 : rendered.info.interactive ? 80 : 90;
  EncodedFrame frame;
  frame.info = rendered.info;
  frame.width = image.width;
  frame.height = image.height;
  frame.background = rendered.background;
  frame.aovs = rendered.aovs;
  auto share = MemoryBudget::take(memory, MemoryUse::encodings, jpegMemory(image.pixels.size()));
  auto jpeg = encodeJpeg(toSrgb8(image, rendered.background), quality, ChromaSampling::full444);
  share.resize(jpeg.size());
  frame.jpeg = withShare(std::move(share), std::move(jpeg));
  frame.image = rendered.image;
  frame.info.encodeUs =
      std::uint32_t(std::chrono::duration_cast<std::chrono::microseconds>(now() - begin).count());
  return frame;
}

namespace {
void encodeAndPublish(Session& session, const RenderedFrame& rendered, const Now& now, const Log& log,
                      const std::shared_ptr<MemoryBudget>& memory) {
  const std::uint32_t revision = rendered.info.revision;
  try {
    session.publish(encodeFrame(rendered, now, memory));
  } catch (const Error& error) {
    session.fail(revision, error);
  } catch (const std::exception& error) {
    log("session " + session.id() + ": encoding failed: " + error.what());
    session.fail(revision, Error(ErrorCode::unsupported, "the picture could not be encoded"));
  }
}
}  // namespace

std::optional<TimePoint> EncodeLoop::step() {
  std::optional<TimePoint> next;
  std::erase_if(jobs_, [](const auto& item) { return item.second->done(); });
  for (const auto& session : store_.all()) {
    const bool busy = jobs_.contains(session.get());
    if (auto rendered = session->takeRendered(busy ? kLargePicture - 1 : ~std::uint64_t(0))) {
      const bool large = rendered->image->pixels.size() >= kLargePicture;
      Background::Work work = [session, rendered = std::move(*rendered), now = now_, log = log_,
                               memory = memory_](const std::stop_token&) {
        encodeAndPublish(*session, rendered, now, log, memory);
      };
      if (large)
        jobs_[session.get()] = pictures_.start(session->id(), std::move(work), wake_);
      else
        work({});
    }
    keepEarlier(next, session->deliver());
  }
  return next;
}

}  // namespace scolopax::server
