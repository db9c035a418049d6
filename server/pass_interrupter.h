// SPDX-License-Identifier: Apache-2.0
// Interrupts sample passes and picks on the render thread. Shared by RenderLoop, ProgressiveRender and
// CurrentPick.
#pragma once
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>

#include "server/frame.h"

namespace scolopax::server {

/// A pass is interrupted by an edit, unless the pass is urgent, and always when the loop stops or when one of
/// its rays takes too long (a pass checks its own time limit only between rays). A pick is like a pass that
/// is not urgent. An interruption lasts until the next reset().
class PassInterrupter {
 public:
  /// `wake` makes watch() run again.
  PassInterrupter(Now now, std::function<void()> wake) : now_(std::move(now)), wake_(std::move(wake)) {}

  // --- any thread ---
  /// Interrupts the running pass unless it is urgent.
  void interrupt() { interrupted_ = true; }
  /// Interrupts the running pass and all later ones.
  void stop();
  /// Interrupts the running pass if it is overdue; returns when to check again. To be called at that time and
  /// after `wake`, on a thread other than the render thread.
  std::optional<TimePoint> watch();

  // --- render thread ---
  void reset();
  /// Becomes true to interrupt a pass.
  const std::atomic<bool>& flag(bool urgent) const { return urgent ? urgentInterrupted_ : interrupted_; }
  /// A pass on the render thread; exists while the pass runs.
  class Watched {
   public:
    /// The pass is overdue from `latest` on.
    Watched(PassInterrupter& interrupter, TimePoint latest) : interrupter_(interrupter) {
      interrupter.begin(latest);
    }
    ~Watched() { interrupter_.end(); }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    PassInterrupter& interrupter_;
  };

 private:
  void begin(TimePoint latest);
  void end();

  const Now now_;
  const std::function<void()> wake_;
  std::atomic<bool> interrupted_{false}, urgentInterrupted_{false}, stopping_{false};
  std::mutex mutex_;
  std::optional<TimePoint> latest_;    ///< of the running pass
  std::optional<TimePoint> nextLook_;  ///< when watch() is called, even without `wake`
};

}  // namespace scolopax::server
