// SPDX-License-Identifier: Apache-2.0
// Handles Ctrl-C and SIGTERM in commands that must save their result.
#pragma once
#include <atomic>

namespace scolopax {

/// From this call on, the first SIGINT or SIGTERM only sets the returned flag. A second one of either kind
/// ends the program at once.
const std::atomic<bool>& catchInterrupts();
/// Ends the program by the caught signal, so that shells see it (status 130 or 143).
[[noreturn]] void endByInterrupt();

}  // namespace scolopax
