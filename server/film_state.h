// SPDX-License-Identifier: Apache-2.0
// What one session's film shows, how far its pass is, and what of it has been shown: from these and the clock
// it follows what is to be done next. Kept by ProgressiveRender.
#pragma once
#include <cstdint>
#include <memory>

#include "server/frame.h"
#include "server/resolution.h"
#include "server/session.h"

namespace scolopax::server {

/// What the renderer knows of the film.
struct FilmProgress {
  std::uint32_t samples = 0;  ///< per pixel
  bool finished = false;      ///< the stop rule is met
};

struct FilmState {
  std::shared_ptr<const ResolvedScene> scene;  ///< that the film shows; null before the first
  std::uint32_t revision = 0;                  ///< of that scene
  double divisor = 1;                          ///< of width and height
  bool recording = false;                      ///< the renderer keeps AOVs
  bool small = false;                          ///< the film was begun while edits arrived
  bool restShown = false;                      ///< the film has been shown since they stopped

  bool unfinished = false;  ///< a pass has begun and was interrupted, or has used up its slice
  bool abandoned = false;   ///< the pass before it was given up for a newer scene
  TimePoint passBegan;
  double passSeconds = 0;  ///< spent on the pass so far

  FrameInfo shown;                  ///< the last frame handed in; revision 0 before the first
  std::uint32_t shownFailures = 0;  ///< of the session, when it was made
  TimePoint shownAt;

  /// Whether the film is not, or no longer, the one to go on with.
  bool stale(const RenderRequest& request) const;
  /// Whether a pass whose scene is stale goes on all the same, for a while: the first of a small picture, and
  /// of one that follows an abandoned pass. However fast edits come, pictures are shown between them.
  bool keepsPass(const RenderRequest& request, const RenderPolicy& policy, TimePoint now) const;
  /// Whether somebody waits for the first picture that has an edit in it.
  bool firstOfEdit(const RenderRequest& request) const;
  /// Whether that picture turns out to cost much more than the passes before it.
  bool lateForEdit(const RenderRequest& request, const RenderPolicy& policy) const;
  /// Whether the film as it stands is worth a frame.
  bool showDue(const RenderRequest& request, const FilmProgress& film, const RenderPolicy& policy,
               TimePoint now) const;
};

}  // namespace scolopax::server
