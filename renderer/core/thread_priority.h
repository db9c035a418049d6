// SPDX-License-Identifier: Apache-2.0
// Lower priority for threads whose work may wait.
#pragma once

namespace scolopax {

/// Lowers the priority of the calling thread: beside a thread of normal priority it gets about a third of a
/// processor. Does nothing on systems other than Linux.
void lowerThreadPriority();

}  // namespace scolopax
