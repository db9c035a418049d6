// SPDX-License-Identifier: Apache-2.0
// State of one session's film: its scene, the progress of its pass, and the last frame shown. With the clock,
// this determines what to do next. Belongs to ProgressiveRender.
#pragma once
#include <cstdint>
#include <memory>

#include "server/frame.h"
#include "server/resolution.h"
#include "server/session.h"

namespace scolopax::server {

/// The renderer's view of the film.
struct FilmProgress {
  std::uint32_t samples = 0;  ///< per pixel
  bool finished = false;      ///< the stop rule is met
};

struct FilmState {
  std::shared_ptr<const ResolvedScene> scene;  ///< the scene that the film shows; null before the first
  std::uint32_t revision = 0;                  ///< of that scene
  double divisor = 1;                          ///< of width and height
  bool recording = false;                      ///< the renderer keeps AOVs
  bool begunInteractive = false;               ///< the film was begun while edits arrived
  bool restShown = false;                      ///< the film has been shown since edits stopped

  bool unfinished = false;  ///< a pass was interrupted or used up its slice
  bool abandoned = false;   ///< the previous pass was abandoned for a newer scene
  TimePoint passBegan;
  double passSeconds = 0;  ///< spent on the pass so far

  FrameInfo shown;                  ///< the last frame submitted; revision 0 before the first
  std::uint32_t shownFailures = 0;  ///< the session's failures when that frame was made
  std::uint32_t shownDrops = 0;     ///< the session's drops when that frame was made
  TimePoint shownAt;

  /// Whether the request needs a new film: another scene, a finer resolution, the scene's own method, or
  /// AOVs.
  bool stale(const RenderRequest& request) const;
  /// Whether a pass continues although its scene is stale, for at most RenderPolicy::shield. This holds for
  /// the first pass of a film begun while edits arrived, and for the first pass after an abandoned one.
  /// Without it, fast edits would prevent any picture from being shown.
  bool shieldsPass(const RenderRequest& request, const RenderPolicy& policy, TimePoint now) const;
  /// Whether edits arrive and the newest one has not been shown.
  bool firstOfEdit(const RenderRequest& request) const;
  /// Whether the first picture after an edit takes longer than RenderPolicy::tooLate and can be restarted at
  /// a lower resolution.
  bool lateForEdit(const RenderRequest& request, const RenderPolicy& policy) const;
  /// Whether a frame should be made of the film in its present state. No frame is made while one with more
  /// samples is shown, which happens after the film has been dropped and rendered again. A script gets one
  /// all the same if its picture was dropped, too, and there is no viewer.
  bool showDue(const RenderRequest& request, const FilmProgress& film, const RenderPolicy& policy,
               TimePoint now) const;
};

}  // namespace scolopax::server
