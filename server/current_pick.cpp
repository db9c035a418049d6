// SPDX-License-Identifier: Apache-2.0
#include "server/current_pick.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "server/render_jobs.h"
#include "server/session.h"

namespace scolopax::server {
namespace {

using protocol::ProtocolError;

/// Number of turns in succession without progress after which a pick goes on in the background. One may be
/// bad luck: an edit that arrives as the turn begins interrupts it.
constexpr int kMostIdleTurns = 2;

/// When a pick that begins now has taken too long.
TimePoint latestEnd(TimePoint now, double seconds) {
  constexpr double kMostSeconds = 1e9;  // can be added to a clock's time without overflow
  return now + std::chrono::duration_cast<TimePoint::duration>(
                   std::chrono::duration<double>(std::min(seconds, kMostSeconds)));
}

PickAnswer tooSlow(double seconds) {
  return {{},
          std::make_exception_ptr(ProtocolError(
              422, "",
              "the pick did not finish within " + shortText(seconds) +
                  " seconds; pick fewer pixels, or render with a lower density or a larger step"))};
}

RenderPart::Render partOf(const std::shared_ptr<Picking>& picking) {
  return [picking](const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) {
    return picking->run(cancel, budget);
  };
}

}  // namespace

std::optional<TimePoint> CurrentPick::dueAt() const {
  return work_ ? std::optional(work_->latest) : std::nullopt;
}

void CurrentPick::supervise() {
  if (!work_) return;
  const auto wanted = session_.request().pick;
  if (!wanted || !has(wanted->id)) return end();
  if (context_.now() >= work_->latest) answer(wanted->id, tooSlow(context_.maxPickSeconds));
}

void CurrentPick::run(const PendingPick& pick, const std::shared_ptr<const ResolvedScene>& scene,
                      std::uint32_t revision, const std::shared_ptr<const Volume>& volume,
                      const std::shared_ptr<const Renderer>& renderer) {
  PickAnswer result;
  try {
    if (!has(pick.id)) {
      end();
      // The picture may have become smaller since the query came.
      const PixelArea area = areaOf(pick.query, scene->render.width, scene->render.height);
      work_.emplace(Work{pick, scene, volume, revision, renderer->pick(scene->render, area),
                         latestEnd(context_.now(), context_.maxPickSeconds)});
    }
    if (!goOn()) return;
    result.found =
        pickedJson(*work_->scene, *work_->volume, work_->revision, pick.query, work_->picking->found());
  } catch (const ProtocolError&) {
    result.failure = std::current_exception();
  } catch (const Error&) {
    result.failure = std::current_exception();
  } catch (const std::bad_alloc&) {
    result.failure = std::make_exception_ptr(Error(ErrorCode::busy, "not enough memory for this pick"));
  } catch (const std::exception& error) {
    context_.log("session " + session_.id() + ": a pick failed: " + error.what());
    result.failure = std::make_exception_ptr(ProtocolError(500, "", "the server failed to answer this pick"));
  }
  answer(pick.id, std::move(result));
}

/// Continues the pick; whether it is complete.
bool CurrentPick::goOn() {
  if (work_->job) {
    std::exchange(work_->job, nullptr)->rethrow();
    if (work_->part->complete()) return true;
  } else if (context_.now() >= slowUntil_) {
    if (runHere()) return true;
    if (context_.now() >= slowUntil_) return false;
  }
  startInBackground();
  return false;
}

/// A turn on the render thread, which any edit interrupts. Rays as long as a turn do not belong here, and
/// edits that come faster than rays end would interrupt them for ever: the background takes over.
bool CurrentPick::runHere() {
  const std::size_t before = work_->picking->samples();
  RenderPart part(partOf(work_->picking), context_.policy.politeSlice, context_.now);
  part.run(interrupter_, false);
  if (part.complete()) return true;
  const bool idle = work_->picking->samples() <= before + 1;
  work_->idleTurns = idle ? work_->idleTurns + 1 : 0;
  if (part.hasSlowRays() || work_->idleTurns == kMostIdleTurns)
    slowUntil_ = context_.now() + RenderPart::kSlowTime;
  return false;
}

void CurrentPick::startInBackground() {
  const auto part = std::make_shared<RenderPart>(partOf(work_->picking), context_.policy.slice, context_.now);
  work_->part = part;
  work_->job = context_.passes.start(
      session_.id(), [part](const std::stop_token& stop) { part->run(stop); }, context_.wake);
}

void CurrentPick::answer(PickId id, PickAnswer answer) {
  end();
  session_.answerPick(id, std::move(answer));
}

void CurrentPick::end() {
  if (work_ && work_->job) work_->job->cancel();
  work_.reset();
}

}  // namespace scolopax::server
