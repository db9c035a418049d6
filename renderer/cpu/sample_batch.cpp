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
SCOLOPAX_SIMD_ONLY void sampleAvx2(const SceneView& scene, std::uint32_t channels, const PointBatch& points,
                                   float (*values)[kBatchPoints]) {
  static_assert(lanes_avx2::kLanes == kBatchPoints);
  lanes_avx2::sampleLanes(scene, channels, lanes_avx2::load(points.x), lanes_avx2::load(points.y),
                          lanes_avx2::load(points.z), values);
}
#endif

}  // namespace

kernel::SampleBatch sampleBatchFor(InstructionSet set) {
#if defined(__x86_64__)
  if (set != InstructionSet::baseline) return sampleAvx2;  // a batch has no more points
#endif
  return sampleBaseline;
}

}  // namespace scolopax
