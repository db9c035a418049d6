// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)
#include "renderer/cpu/lanes_avx512.h"
// Must follow the lane type.
#include "tests/support/sample_lanes_of_set.h"

namespace scolopax::test {

LaneSampler avx512LaneSampler() { return {lanes_avx512::kLanes, lanes_avx512::sampleLanes}; }

}  // namespace scolopax::test
#endif
