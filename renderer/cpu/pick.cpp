// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/pick.h"

#include <utility>

#include "renderer/data/sampling.h"
#include "renderer/kernel/rng.h"

namespace scolopax {
namespace {

const std::atomic<bool> kNever{false};

class CpuPicking final : public Picking {
 public:
  CpuPicking(const RenderPlan& plan, const Scene& scene, const PixelArea& area, TileFunction tiles)
      : plan_(plan),
        sampling_(scene.sampling),
        filter_(scene.filter),
        tiles_(tiles),
        view_(plan.view()),
        pixels_(pixelsToPick(area)),
        count_(std::size_t(pickSamples(pixels_.size()))) {
    view_.rays = makeCameraRays(scene.camera, plan.grid(), scene.width, scene.height);
    // Depths from where rays start: from a far eye they would be too coarse for a point.
    start_ = double(std::exchange(view_.rays.start, 0.0f));
    halfSize_ = view_.rays.halfSize;
    view_.width = view_.height = 1;
    view_.seed = scene.seed;
    view_.filterBox = false;  // we place the samples, to know their rays
    view_.step = view_.smallestSpacing * float(scene.step);
    view_.lightCount = 0;
  }

  bool run(std::chrono::nanoseconds budget) override {
    const auto deadline = std::chrono::steady_clock::now() + budget;
    for (; at_ < pixels_.size(); ++at_) {
      while (samples_.size() < count_) {
        // A picture of one pixel, whose centre is where the sample lies.
        view_.rays.halfSize = halfSizeFor(samples_.size());
        const auto number = numberOf(samples_.size());
        kernel::FirstCollision met;
        glm::vec4 color;
        std::uint8_t done = 0;
        tiles_({view_, number, &color, nullptr, &met, &done, &kNever, deadline}, 0, 0);
        if (!done) return false;
        samples_.push_back(met);
      }
      if (const auto sample = visibleSample(samples_)) found_.push_back(pickedBy(*sample));
      samples_.clear();
    }
    return true;
  }

  const std::vector<Picked>& found() const override { return found_; }

 private:
  kernel::SampleNumber numberOf(std::size_t sample) const {
    return sampleNumber(sampling_, std::uint32_t(sample));
  }

  /// Of rays through (0.5, 0.5) for a sample of the pixel: placed as those of a picture are.
  glm::vec2 halfSizeFor(std::size_t sample) const {
    glm::vec2 place(0.5f);
    if (filter_ == PixelFilter::box) {
      const auto number = numberOf(sample);
      const auto jitter = kernel::Sampler(0, number, view_.seed).next();
      place = {kernel::uniformOf(jitter.x), kernel::uniformOf(jitter.y)};
    }
    return halfSize_ - glm::vec2(pixels_[at_]) - (place - 0.5f);
  }

  /// Where a sample of the pixel has ended.
  Picked pickedBy(std::size_t sample) const {
    const kernel::FirstCollision& met = samples_[sample];
    kernel::CameraRays rays = view_.rays;
    rays.halfSize = halfSizeFor(sample);
    const kernel::Ray ray = rays(0.5f, 0.5f);
    const float t = met.depth / rays.depth(0.5f, 0.5f, 1.0f);
    const glm::dvec3 voxel = glm::dvec3(ray.origin) + double(t) * glm::dvec3(ray.direction);
    return {glm::dvec3(plan_.grid().worldFromVoxel * glm::dvec4(voxel, 1)), voxel,
            plan_.visibleChannels()[std::size_t(met.channel)], start_ + double(met.depth)};
  }

  const RenderPlan& plan_;
  const Sampling sampling_;
  const PixelFilter filter_;
  const TileFunction tiles_;
  kernel::SceneView view_;  // of the pixel that is looked at
  double start_ = 0;
  glm::vec2 halfSize_{0};  // of the picture
  const std::vector<glm::ivec2> pixels_;
  const std::size_t count_;  // of samples a pixel
  std::size_t at_ = 0;
  std::vector<kernel::FirstCollision> samples_;  // of that pixel so far
  std::vector<Picked> found_;
};

}  // namespace

std::unique_ptr<Picking> makeCpuPicking(const RenderPlan& plan, const Scene& scene, const PixelArea& area,
                                        TileFunction tiles) {
  return std::make_unique<CpuPicking>(plan, scene, area, tiles);
}

}  // namespace scolopax
