// SPDX-License-Identifier: Apache-2.0
// Limits how many requests may take long or wait at once. HttpConnection takes a slot before it calls the
// handler.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace scolopax::net {

/// Must outlive its slots. Every function may be called from any thread.
class RequestSlots {
 public:
  /// Numbers of slots for long requests, and for requests of one flow that wait.
  RequestSlots(int longRequests, int waitingRequests)
      : mostLong_(longRequests), mostWaiting_(waitingRequests) {}

  /// Released by its last owner; null if none was free.
  using Slot = std::shared_ptr<const void>;
  /// A slot for a long request. Requests of quick routes get at most a quarter of the slots: their results
  /// are computed once for all clients, and a client that sends many of them must not keep other requests
  /// out.
  Slot takeLong(bool ofQuickRoute);
  /// A slot for a request that waits.
  Slot takeWaiting(const std::string& flow);

 private:
  void releaseWaiting(const std::string& flow);

  const int mostLong_, mostWaiting_;
  std::mutex mutex_;                    ///< guards the members below
  int long_ = 0, quick_ = 0;            ///< taken slots; of these, the ones of quick routes
  std::map<std::string, int> waiting_;  ///< requests that wait, by flow
};

}  // namespace scolopax::net
