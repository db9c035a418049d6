// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/instruction_set.h"

#include <cstdlib>

namespace scolopax {

std::string_view nameOf(InstructionSet set) {
  constexpr std::string_view names[] = {"baseline", "avx2", "avx512"};
  return names[int(set)];
}

bool available(InstructionSet set) {
  switch (set) {
#if defined(__x86_64__)
#if !defined(SCOLOPAX_WITHOUT_AVX512)
    case InstructionSet::avx512:
      return available(InstructionSet::avx2) && __builtin_cpu_supports("avx512f") &&
             __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl");
#endif
    case InstructionSet::avx2:
      return __builtin_cpu_supports("avx2");
#endif
    default:
      return set == InstructionSet::baseline;
  }
}

InstructionSet fastestInstructionSet() {
  static const InstructionSet fastest = [] {
    const char* text = std::getenv("SCOLOPAX_INSTRUCTIONS");
    const std::string_view most = text ? text : "";
    if (most == "baseline") return InstructionSet::baseline;
    if (most != "avx2" && available(InstructionSet::avx512)) return InstructionSet::avx512;
    return available(InstructionSet::avx2) ? InstructionSet::avx2 : InstructionSet::baseline;
  }();
  return fastest;
}

}  // namespace scolopax
