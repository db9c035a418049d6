// SPDX-License-Identifier: Apache-2.0
// The instruction sets for which there is code.
#pragma once
#include <string_view>

namespace scolopax {

/// Each includes those before it.
enum class InstructionSet { baseline, avx2, avx512 };
std::string_view nameOf(InstructionSet set);

/// Whether this processor supports the set.
bool available(InstructionSet set);
/// The fastest set that this processor supports. The environment variable SCOLOPAX_INSTRUCTIONS (baseline or
/// avx2) sets an upper limit, for measurements and tests.
InstructionSet fastestInstructionSet();

}  // namespace scolopax
