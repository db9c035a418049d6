// SPDX-License-Identifier: Apache-2.0
// For threads whose work may wait for that of others.
#pragma once

namespace scolopax {

/// The calling thread gets about a third of a processor beside one of usual priority. Where the system has no
/// such thing, nothing happens.
void lowerThreadPriority();

}  // namespace scolopax
