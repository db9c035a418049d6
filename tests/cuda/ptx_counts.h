// SPDX-License-Identifier: Apache-2.0
// What translated PTX has executed. Only translations with --count add to it (ptx_to_cpp.py).
#pragma once
#include "tests/cuda/ptx_machine.h"

namespace ptx {

/// Sums over all threads. A vector is loaded by one load.
struct Counts {
  std::uint64_t instructions = 0;            ///< also those that their guard skips
  std::uint64_t loads = 0, loadedBytes = 0;  ///< from global memory
  std::uint64_t localLoads = 0, localBytes = 0;
};
/// Not synchronised: kernels that are counted must run in one thread of the host.
inline Counts counts;

/// Loads of the kernel's parameters count only as instructions: a device keeps them in its constant cache.
inline void countLoad(const Thread& thread, std::uint64_t address, std::size_t size) {
  for (const Frame* frame = thread.local; frame; frame = frame->outer)
    if (frame->range.holds(address, size)) {
      ++counts.localLoads;
      counts.localBytes += size;
      return;
    }
  for (const Range& range : thread.parameters)
    if (range.holds(address, size)) return;
  ++counts.loads;
  counts.loadedBytes += size;
}

}  // namespace ptx
