// SPDX-License-Identifier: Apache-2.0
#include "server/render_loop.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "server/encoder.h"

namespace scolopax::server {
namespace {

void keepEarlier(std::optional<TimePoint>& a, const std::optional<TimePoint>& b) {
  if (b) a = a ? std::min(*a, *b) : *b;
}

}  // namespace

RenderLoop::RenderLoop(SessionStore& store, MakeRenderer makeRenderer, ProgressiveRender::Options options,
                       Now now, Log log, OnPass onPass)
    : store_(store),
      makeRenderer_(std::move(makeRenderer)),
      options_(options),
      now_(std::move(now)),
      log_(std::move(log)),
      onPass_(std::move(onPass)) {}

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
      renders_.push_back(
          std::make_unique<ProgressiveRender>(session, makeRenderer_, options_, now_, log_, interrupted_));
}

RenderLoop::Renders::iterator RenderLoop::nextTurn() {
  using Work = ProgressiveRender::Work;
  auto urgent = renders_.end(), still = renders_.end(), any = renders_.end();
  int urgents = 0;
  for (auto render = renders_.begin(); render != renders_.end(); ++render) {
    const Work work = (*render)->work();
    if (work == Work::none) continue;
    if (any == renders_.end()) any = render;
    if (work == Work::still && still == renders_.end()) still = render;
    if (work == Work::urgent && urgents++ == 0) urgent = render;
  }
  const bool stillsTurn = lastUrgent_ && still != renders_.end();
  const auto turn = urgents == 0 ? any : stillsTurn ? still : urgent;
  lastUrgent_ = urgents > 0 && turn == urgent;
  othersUrgent_ = urgents > 0 && turn != urgent;
  return turn;
}

std::optional<TimePoint> RenderLoop::step() {
  std::optional<TimePoint> next = store_.expire();
  followStore();
  interrupted_ = false;  // an edit from here on interrupts the pass; those before are seen by nextTurn()
  const auto turn = nextTurn();
  if (turn != renders_.end()) {
    // Behind all others before it runs: a session of slow passes gets one turn in the round as well.
    std::rotate(turn, turn + 1, renders_.end());
    ProgressiveRender::Others others;
    others.urgent = othersUrgent_;
    for (const auto& render : renders_) {
      if (render == renders_.back()) continue;
      others.filmPixels += render->filmPixels();
      others.edited += render->edited();
    }
    onPass_(renders_.back()->run(others));
    return now_();
  }
  for (const auto& render : renders_) keepEarlier(next, render->dueAt());
  return next;
}

EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now) {
  const TimePoint begin = now();
  const Image& image = *rendered.image;
  // A picture that will be enlarged has few bytes, and its compression would show enlarged as well.
  const int quality = rendered.info.reduced ? 95 : rendered.info.interactive ? 80 : 90;
  EncodedFrame frame;
  frame.info = rendered.info;
  frame.width = image.width;
  frame.height = image.height;
  frame.background = rendered.background;
  frame.aovs = rendered.aovs;
  frame.jpeg = std::make_shared<const std::vector<unsigned char>>(
      encodeJpeg(toSrgb8(image, rendered.background), quality, ChromaSampling::full444));
  frame.image = rendered.image;
  frame.info.encodeUs =
      std::uint32_t(std::chrono::duration_cast<std::chrono::microseconds>(now() - begin).count());
  return frame;
}

std::optional<TimePoint> EncodeLoop::step() {
  std::optional<TimePoint> next;
  for (const auto& session : store_.all()) {
    if (const auto rendered = session->takeRendered()) {
      try {
        session->publish(encodeFrame(*rendered, now_));
      } catch (const std::exception& error) {
        log_("session " + session->id() + ": encoding failed: " + error.what());
        session->fail(rendered->info.revision, "the picture could not be encoded");
      }
    }
    keepEarlier(next, session->deliver());
  }
  return next;
}

}  // namespace scolopax::server
