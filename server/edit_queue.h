// SPDX-License-Identifier: Apache-2.0
// The edits of one client, in order. An edit that needs measurements of the data waits for them. It blocks
// neither a network thread nor the client's other messages.
#pragma once
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "server/background.h"
#include "server/unmeasured.h"

namespace scolopax::server {

class EditQueue : public std::enable_shared_from_this<EditQueue> {
 public:
  /// Limits on the number and total bytes of the edits that wait. A single edit may have more bytes.
  static constexpr std::size_t kMaxEdits = 256, kMaxBytes = 256 << 10;

  struct Edit {
    std::function<void()> apply;  ///< throws Unmeasured if it must wait
    std::function<void(std::exception_ptr)>
        failed;             ///< receives the other exceptions of apply(); must not throw
    std::size_t bytes = 0;  ///< size of the edit's message
  };

  /// `background` must outlive the queue's jobs. They belong to the flow of the session.
  EditQueue(Background& background, std::string session)
      : background_(background), session_(std::move(session)) {}

  /// Applies the edit on the calling thread. If it or an earlier edit must wait, it is applied later, in the
  /// background. Throws ProtocolError(429) if too many edits wait.
  void push(Edit edit);
  /// Fails the edits that wait and cancels their measurement. After it has returned, no edit is applied, and
  /// none may be pushed.
  void end();

 private:
  bool applyAll();
  void applyMeasured(const std::stop_token& stop);
  bool roomFor(const Edit& edit) const;
  std::optional<Edit> next();
  void abandon(const Edit& edit);
  void done(const Edit& edit);

  Background& background_;
  const std::string session_;  ///< its id
  std::stop_source ended_;
  std::mutex applying_;  ///< held while an edit is applied; taken before mutex_

  std::mutex mutex_;                   ///< guards the members below
  std::deque<Edit> waiting_;           ///< oldest first, without the one being applied
  std::size_t count_ = 0, bytes_ = 0;  ///< of all edits pushed and not yet done
  bool atWork_ = false;                ///< a thread applies edits; it owns missing_
  std::optional<Unmeasured> missing_;
};

}  // namespace scolopax::server
