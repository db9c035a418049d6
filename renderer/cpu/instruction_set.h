// SPDX-License-Identifier: Apache-2.0
// The processor's instruction sets that there is code for.
#pragma once

namespace scolopax {

/// Each has what those before it have.
enum class InstructionSet { baseline, avx2, avx512 };

/// Whether this processor has it.
bool available(InstructionSet set);
/// The fastest that this processor has; at most the one that SCOLOPAX_INSTRUCTIONS names in the environment
/// (baseline, avx2), for measurements and tests.
InstructionSet fastestInstructionSet();

}  // namespace scolopax
