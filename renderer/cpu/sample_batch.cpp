// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/sample_batch.h"

#include "renderer/cpu/sample_lanes.h"
#include "renderer/kernel/sample_volume.h"

namespace scolopax {
namespace {

using kernel::kBatchPoints;
using kernel::PointBatch;
using kernel::SceneView;

void sampleBaseline(const SceneView& scene, std::uint32_t channels, const PointBatch& points,
                    float (*values)[kBatchPoints]) {
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(channels >> n & 1)) continue;
    for (int i = 0; i < kBatchPoints; ++i)
      values[n][i] =
          kernel::sampleStored(scene.channels[n], scene.dims, {points.x[i], points.y[i], points.z[i]});
  }
}

#if defined(__x86_64__)
SCOLOPAX_AVX2_ONLY void sampleAvx2(const SceneView& scene, std::uint32_t channels, const PointBatch& points,
                                   float (*values)[kBatchPoints]) {
  static_assert(lanes::kLanes == kBatchPoints);
  lanes::sampleLanes(scene, channels, lanes::load(points.x), lanes::load(points.y), lanes::load(points.z),
                     values);
}
#endif

}  // namespace

bool available(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2");
#endif
  return set == InstructionSet::baseline;
}

InstructionSet fastestInstructionSet() {
  return available(InstructionSet::avx2) ? InstructionSet::avx2 : InstructionSet::baseline;
}

kernel::SampleBatch sampleBatchFor(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx2) return sampleAvx2;
#endif
  return set == InstructionSet::baseline ? sampleBaseline : nullptr;
}

}  // namespace scolopax
