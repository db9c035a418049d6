// SPDX-License-Identifier: Apache-2.0
// Threads that encode the pictures of answers. Between the handlers of GET .../frame and POST /render, and
// imageBytes().
#pragma once
#include <functional>
#include <stop_token>
#include <string>

#include "server/net/fair_pool.h"

namespace scolopax::server {

/// At most two pictures are encoded at once, at low priority, so that others' frames are not delayed; of one
/// flow (net::FairPool), one. Every function may be called from any thread.
class AnswerEncoders {
 public:
  AnswerEncoders();
  /// Runs encode() when it is the flow's turn. Throws what encode() throws, and Error(cancelled) if `stop`
  /// has been requested by then.
  void run(const std::string& flow, const std::stop_token& stop, const std::function<void()>& encode);

 private:
  net::FairPool pool_;
};

}  // namespace scolopax::server
