// SPDX-License-Identifier: Apache-2.0
// How code on a device reads a flag that the host may set while the kernel runs.
#pragma once
#include <atomic>

#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

/// For how long the answer "no" holds, in clock cycles: 0.1 to 0.3 ms. Reading memory of the host takes
/// longer than a microsecond, and the bus to it is shared by all threads.
inline constexpr unsigned kAnswerCycles = 1u << 18;

#if defined(__CUDACC__)
/// Whether the flag, in memory of the host that is mapped to the device, is set. Its threads share when a
/// block last read "no", and so read the flag seldom, but all of them once it is set.
__device__ inline bool isSetOnHost(const std::atomic<bool>* flag) {
  static_assert(sizeof *flag == 1);
  // Undefined when a block begins: the flag is then read at once or, rarely, kAnswerCycles later.
  __shared__ volatile unsigned answered;
  unsigned now;
  asm volatile("mov.u32 %0, %%clock;" : "=r"(now));
  if (now - answered < kAnswerCycles) return false;
  if (*reinterpret_cast<const volatile unsigned char*>(flag) != 0) return true;
  answered = now;
  return false;
}
#endif

}  // namespace scolopax::kernel
