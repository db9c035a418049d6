// SPDX-License-Identifier: Apache-2.0
// Runs a library that may crash or hang on damaged files in a child process, and takes what it finds through
// a pipe. Between the readers and libraries such as HDF5.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <span>
#include <stop_token>
#include <string>

namespace scolopax::io {

/// What a child may use. The child ends when one is exceeded.
struct ApartLimits {
  std::uint64_t memoryBytes = std::uint64_t(1) << 30;  ///< beyond what the process has when it starts
  std::chrono::seconds computing{60};                  ///< of processor time
  std::chrono::milliseconds silence{120'000};          ///< between two messages
  std::uint64_t messageBytes = std::uint64_t(64) << 20;
};

/// The child's end of the pipe.
class Sender {
 public:
  explicit Sender(int pipe) : pipe_(pipe) {}
  /// Sends one message, the parts one after the other. Ends the process if nobody listens any more.
  void send(std::initializer_list<std::span<const std::byte>> parts) const;
  /// The parent warns so.
  void warn(const std::string& line) const;

 private:
  int pipe_;
};

/// In a child: it can open no more files, whatever the one that it has opened makes the library do.
void forbidOpening();

/// What the parent does with what the child sends. Both may throw, which ends the child.
struct Receiver {
  std::function<void(std::span<const std::byte>)> message;
  std::function<void(const std::string&)> warn;
};

/// Runs `work` in a forked child that has no other open descriptors, prints nothing and ends with this
/// process. Returns after it has ended. `work` must not touch what other threads may have locked when the
/// child began: loggers, TBB, a Loading. An Error that it throws is thrown here. `what` begins other
/// messages. Throws Error: badInput if the child crashes or takes too long, tooLarge if it runs out of
/// memory, cancelled once `stop` is requested, busy if there can be no child.
void runApart(const std::string& what, const ApartLimits& limits, const std::stop_token& stop,
              const std::function<void(const Sender&)>& work, const Receiver& receiver);

}  // namespace scolopax::io
