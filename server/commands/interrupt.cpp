// SPDX-License-Identifier: Apache-2.0
#include "server/commands/interrupt.h"

#include <csignal>
#include <cstdlib>

namespace scolopax {
namespace {

std::atomic<bool> interrupted{false};
volatile std::sig_atomic_t caught = 0;
static_assert(std::atomic<bool>::is_always_lock_free);  // required in a signal handler

extern "C" void onInterrupt(int signal) {
  caught = signal;
  interrupted = true;
  for (const int other : {SIGTERM, SIGINT}) std::signal(other, SIG_DFL);  // a second one ends at once
}

}  // namespace

const std::atomic<bool>& catchInterrupts() {
  struct sigaction action = {};
  action.sa_handler = onInterrupt;
  action.sa_flags = int(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGTERM, SIGINT}) sigaction(signal, &action, nullptr);
  return interrupted;
}

void endByInterrupt() {
  const int signal = caught;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  std::_Exit(128 + signal);
}

}  // namespace scolopax
