// SPDX-License-Identifier: Apache-2.0
#include "server/film_state.h"

#include <algorithm>
#include <bit>

namespace scolopax::server {

bool FilmState::stale(const RenderRequest& request) const {
  // When edits have stopped, the resolution returns to full in steps. A film that already has full resolution
  // continues if it was drawn with the scene's own method.
  const bool finerDue = divisor != 1 && (begunInteractive || restShown || !request.pollSamples.empty());
  // While edits arrive, `auto` is drawn with a fixed step (drawnScene). More samples do not reduce its bias.
  const bool methodDue = begunInteractive && scene && scene->render.method == Method::automatic;
  return !scene || request.revision != revision || (!request.interactive && (finerDue || methodDue)) ||
         (request.aovs && !recording);
}

bool FilmState::shieldsPass(const RenderRequest& request, const RenderPolicy& policy, TimePoint now) const {
  return unfinished && shown.revision != revision &&
         ((request.interactive && begunInteractive) || abandoned) && now - passBegan < policy.shield;
}

bool FilmState::firstOfEdit(const RenderRequest& request) const {
  return request.interactive && shown.revision != request.revision;
}

bool FilmState::lateForEdit(const RenderRequest& request, const RenderPolicy& policy) const {
  return unfinished && begunInteractive && firstOfEdit(request) && divisor < kMaxDivisor &&
         passSeconds >= std::chrono::duration<double>(policy.tooLate).count();
}

bool FilmState::showDue(const RenderRequest& request, const FilmProgress& film, const RenderPolicy& policy,
                        TimePoint now) const {
  const std::uint32_t samples = film.samples;
  if (samples == 0) return false;
  if (shown.revision != revision || shown.interactive != request.interactive) return true;
  if (request.failures != shownFailures) return true;
  const bool dropped = request.drops != shownDrops;
  // If the film was dropped, too, a script need not wait until it has as many samples again.
  if (dropped && !request.viewed &&
      std::any_of(request.pollSamples.begin(), request.pollSamples.end(),
                  [&](std::uint32_t wanted) { return wanted <= samples; }))
    return true;
  if (!shown.reduced && samples < shown.samples) return false;
  if (dropped) return true;
  if (shown.mixed && !request.pollSamples.empty()) return true;
  if (!request.interactive && divisor == 1 && film.finished) return !shown.final;
  if (samples == shown.samples) return false;
  if (std::any_of(request.pollSamples.begin(), request.pollSamples.end(),
                  [&](std::uint32_t wanted) { return shown.samples < wanted && wanted <= samples; }))
    return true;
  return std::has_single_bit(samples) ||
         now - shownAt >= (request.interactive ? policy.interactiveInterval : policy.stillInterval);
}

}  // namespace scolopax::server
