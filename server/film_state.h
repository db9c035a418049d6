// SPDX-License-Identifier: Apache-2.0
// State of one session's film: the scene that it shows, how far its pass has come, and the last frame shown.
// Together with the clock, it determines what to do next. Kept by ProgressiveRender.
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
  std::shared_ptr<const ResolvedScene> scene;  ///< the scene that the film shows; null before the first
  std::uint32_t revision = 0;                  ///< of that scene
  double divisor = 1;                          ///< of width and height
  bool recording = false;                      ///< the renderer keeps AOVs
  bool begunInteractive = false;               ///< the film was begun while edits arrived
  bool restShown = false;                      ///< the film has been shown since edits stopped

  bool unfinished = false;  ///< a pass was interrupted or has used up its slice
  bool abandoned = false;   ///< the previous pass was abandoned for a newer scene
  TimePoint passBegan;
  double passSeconds = 0;  ///< spent on the pass so far

  FrameInfo shown;                  ///< the last frame handed in; revision 0 before the first
  std::uint32_t shownFailures = 0;  ///< the session's failures when that frame was made
  TimePoint shownAt;

  /// Whether the request needs a new film: for another scene, a finer resolution, the scene's own method, or
  /// AOVs.
  bool stale(const RenderRequest& request) const;
  /// Whether a pass whose scene is stale continues, up to RenderPolicy::shield: the first pass of a film
  /// begun while edits arrived, and the first after an abandoned pass. So pictures are shown however fast
  /// edits come.
  bool shieldsPass(const RenderRequest& request, const RenderPolicy& policy, TimePoint now) const;
  /// Whether edits arrive and the newest one has not been shown yet.
  bool firstOfEdit(const RenderRequest& request) const;
  /// Whether the first picture after an edit takes longer than RenderPolicy::tooLate and can be restarted at
  /// a lower resolution.
  bool lateForEdit(const RenderRequest& request, const RenderPolicy& policy) const;
  /// Whether a frame should be made of the film in its present state. None is as long as one with more
  /// samples is shown: the film was dropped meanwhile.
  bool showDue(const RenderRequest& request, const FilmProgress& film, const RenderPolicy& policy,
               TimePoint now) const;
};

}  // namespace scolopax::server
