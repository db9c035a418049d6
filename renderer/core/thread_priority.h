// SPDX-License-Identifier: Apache-2.0
// For threads whose work may wait for that of others.
#pragma once

namespace scolopax {

/// The calling thread gets a processor only when no thread of usual priority wants it, or nearly so. Where
/// the system has no such thing, nothing happens.
void lowerThreadPriority();

}  // namespace scolopax
