// SPDX-License-Identifier: Apache-2.0
#define SCOLOPAX_PLAIN_SCENES
#include "tests/cuda/printed_sync_dda.h"

#include "cuda/pixel_kernels.h"
#include "renderer/kernel/analog.h"

namespace scolopax::test {

/// A walk from macrocell to macrocell without leaps over empty ones; a distance drawn for every channel in
/// every macrocell, also where it has no extinction; distances along the ray in a single float. The loop has
/// no other end than the printed ones.
struct PrintedSyncDda {
  template <class Blend>
  SCOLOPAX_HD static std::optional<kernel::Collision> track(const PrintedView& scene, const kernel::Ray& ray,
                                                            kernel::Interval inside, kernel::Sampler& sampler,
                                                            kernel::SampleCost* cost) {
    kernel::MajorantView cells = scene.majorants;
    cells.totals = nullptr;  // which tell where a walk may leap
    kernel::CellWalk walk(ray, inside, cells);
    std::optional<kernel::Collision> hit;
    do {
      ++cost->cellSteps;
      for (int n = 0; n < scene.channelCount; ++n) {
        const float majorant =
            scene.printedMajorants[walk.index() * std::size_t(scene.channelCount) + std::size_t(n)];
        float t = walk.enter();
        while (true) {
          const kernel::RandomBlock random = sampler.next();
          t += kernel::opticalDepth(kernel::uniformOf(random.x)) / majorant;
          if ((hit && t > hit->distance.t()) || !(t < walk.exit())) break;
          const kernel::RayDistance distance{t, 0.0f};
          const auto found = kernel::testChannel<Blend>(scene, kernel::AllChannels{}, n, majorant, distance,
                                                        walk.pointAt(t), random, cost);
          if (!found) continue;
          hit = found;
          break;
        }
      }
    } while (!hit && walk.advance());
    return hit;
  }
};

template <class Lighting>
cudaError_t launchLit(const cuda::DeviceBand& band, const float* majorants, cudaStream_t stream) {
  return cuda::launchView<kernel::Analog<PrintedSyncDda>, kernel::BlendDensity, Lighting>(
      PrintedView{{band.scene}, majorants}, band, stream);
}

cudaError_t launchPrinted(const cuda::DeviceBand& band, const float* majorants, bool lit,
                          cudaStream_t stream) {
  return lit ? launchLit<kernel::Lit>(band, majorants, stream)
             : launchLit<kernel::Unlit>(band, majorants, stream);
}

}  // namespace scolopax::test
