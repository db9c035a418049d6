// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)
#include "renderer/cpu/lanes_avx2.h"
// Must follow the lane type.
#include "tests/support/sample_lanes_of_set.h"

namespace scolopax::test {

LaneSampler avx2LaneSampler() { return {lanes_avx2::kLanes, lanes_avx2::sampleLanes}; }

}  // namespace scolopax::test
#endif
