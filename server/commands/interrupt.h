// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM for commands that have something to save.
#pragma once
#include <atomic>

namespace scolopax {

/// From here on, the first SIGINT or SIGTERM only sets the returned flag; a second one of either kind ends
/// the program at once.
const std::atomic<bool>& catchInterrupts();
/// Ends the program by the signal that was caught, so that shells see it (status 130 or 143).
[[noreturn]] void endByInterrupt();

}  // namespace scolopax
