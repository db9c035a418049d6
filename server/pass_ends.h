// SPDX-License-Identifier: Apache-2.0
// What ends passes on the render thread before their time is over. Between RenderLoop and ProgressiveRender.
#pragma once
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>

#include "server/frame.h"

namespace scolopax::server {

/// Passes end early for edits, unless they are urgent; and for whatever happens when the loop stops, or when
/// one of their rays takes too long: the time limit of a pass is only looked at between rays. What ends a
/// pass holds until the next reset().
class PassEnds {
 public:
  /// `wake` makes watch() run again.
  PassEnds(Now now, std::function<void()> wake) : now_(std::move(now)), wake_(std::move(wake)) {}

  // --- any thread ---
  /// Ends the running pass unless it is urgent.
  void interrupt() { interrupted_ = true; }
  /// Ends the running pass, and all later ones at once.
  void stop();
  /// Ends the running pass if it is overdue; returns when to look again. To be called when that time comes
  /// and after `wake`, on a thread other than the render thread.
  std::optional<TimePoint> watch();

  // --- render thread ---
  void reset();
  /// Becomes true to end a pass.
  const std::atomic<bool>& flag(bool urgent) const { return urgent ? ended_ : interrupted_; }
  /// The time of a pass on the render thread.
  class Watched {
   public:
    /// The pass is overdue from `latest` on.
    Watched(PassEnds& ends, TimePoint latest) : ends_(ends) { ends.begin(latest); }
    ~Watched() { ends_.end(); }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    PassEnds& ends_;
  };

 private:
  void begin(TimePoint latest);
  void end();

  const Now now_;
  const std::function<void()> wake_;
  std::atomic<bool> interrupted_{false}, ended_{false}, stopping_{false};
  std::mutex mutex_;
  std::optional<TimePoint> latest_;    ///< of the running pass
  std::optional<TimePoint> nextLook_;  ///< when watch() is called even without `wake`
};

}  // namespace scolopax::server
