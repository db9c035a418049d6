// SPDX-License-Identifier: Apache-2.0
// One client's edits in their order. Those that need data measured wait for it, and hold up neither a thread
// of the network nor the messages that come behind them.
#pragma once
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "server/background.h"
#include "server/unmeasured.h"

namespace scolopax::server {

class EditQueue : public std::enable_shared_from_this<EditQueue> {
 public:
  /// Edits that may wait at once, and their bytes, unless there is but one.
  static constexpr std::size_t kMaxEdits = 256, kMaxBytes = 256 << 10;

  struct Edit {
    std::function<void()> apply;                     ///< throws Unmeasured as long as it has to wait
    std::function<void(std::exception_ptr)> failed;  ///< told what else it throws; must not throw
    std::size_t bytes = 0;                           ///< as it came
  };

  /// `background` must outlive what the queue does.
  explicit EditQueue(Background& background) : background_(background) {}

  /// Applies the edit, here, unless it or one before it has to wait; then it is applied later, in the
  /// background. Throws ProtocolError(429) when too many wait.
  void push(Edit edit);
  /// Fails what waits and stops its measuring. No edit is applied after this returns, and nothing may be
  /// pushed.
  void end();

 private:
  bool applyAll();
  void applyMeasured(const std::stop_token& stop);
  bool roomFor(const Edit& edit) const;
  std::optional<Edit> next();
  void abandon(const Edit& edit);
  void done(const Edit& edit);

  Background& background_;
  std::stop_source ended_;
  std::mutex applying_;  ///< held while an edit is applied; taken before mutex_

  std::mutex mutex_;                   ///< of what follows
  std::deque<Edit> waiting_;           ///< the oldest first, but for the one that is being applied
  std::size_t count_ = 0, bytes_ = 0;  ///< of all that were pushed and are not done
  bool atWork_ = false;                ///< one thread is applying edits; it owns missing_
  std::optional<Unmeasured> missing_;
};

}  // namespace scolopax::server
