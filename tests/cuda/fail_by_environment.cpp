// SPDX-License-Identifier: Apache-2.0
// Lets tests of the whole program make the device fail at call number FAIL_CALL of the runtime, and limit its
// memory to DEVICE_BYTES.
#include <cstdlib>

#include "tests/cuda/substitute_runtime.h"

namespace {

const bool kDone = [] {
  if (const char* call = std::getenv("FAIL_CALL"))
    substitute::failCall(std::strtoul(call, nullptr, 10), cudaErrorIllegalAddress);
  if (const char* bytes = std::getenv("DEVICE_BYTES"))
    substitute::limitMemory(std::strtoul(bytes, nullptr, 10));
  return true;
}();

}  // namespace
