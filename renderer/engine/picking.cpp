// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/picking.h"

#include <algorithm>
#include <utility>

#include "renderer/data/resolution.h"
#include "renderer/data/sampling.h"

namespace scolopax {
namespace {

/// Distance between samples with the filter `point`, in pixels: so small that they are practically one point.
constexpr float kPointUnit = 0x1p-20f;

class SampledPicking final : public Picking {
 public:
  SampledPicking(std::shared_ptr<Launcher> launcher, std::shared_ptr<const RenderPlan> plan,
                 const Scene& scene, const PixelArea& area)
      : launcher_(std::move(launcher)),
        plan_(std::move(plan)),
        method_(scene.method),
        number_(sampleNumber(Sampling::independent, 0)),
        pixels_(pixelsToPick(area)),
        side_(pickSamplesSide(pixels_.size())),
        isPoint_(scene.filter == PixelFilter::point),
        unit_(isPoint_ ? kPointUnit : 1.0f / float(side_)),
        view_(plan_->view()) {
    view_.shading = view_.shadows = false;  // lighting does not change what a ray hits
    view_.lightCount = 0;
    view_.rays = makeCameraRays(scene.camera, plan_->grid(), scene.width, scene.height);
    // Depths are measured from where rays start: from a distant eye, they would be too coarse for a point.
    start_ = double(std::exchange(view_.rays.start, 0.0f));
    halfSize_ = view_.rays.halfSize;
    view_.rays.pixelSize *= unit_;
    view_.width = view_.height = side_;
    view_.seed = scene.seed;
    view_.filterWidth = 0;
    setResolution(view_, resolutionOf(scene));
    const auto samples = std::size_t(side_ * side_);
    met_.resize(samples);
    colors_.resize(samples);
    done_.resize(samples);
  }

  bool run(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    const auto deadline = std::chrono::steady_clock::now() + budget;
    for (; at_ < pixels_.size(); ++at_) {
      // Renders a picture of the pixel in which every pixel is a sample, because kernels take many pixels at
      // a time.
      const glm::vec2 corner = glm::vec2(pixels_[at_]) + (isPoint_ ? 0.5f : 0.0f);
      view_.rays.halfSize = (halfSize_ - corner) / unit_;
      if (!launcher_->launch({.plan = plan_.get(),
                              .method = method_,
                              .scene = view_,
                              .number = number_,
                              .pixels = colors_.data(),
                              .first = met_.data(),
                              .done = done_.data(),
                              .cancel = &cancel,
                              .deadline = deadline}))
        return false;
      if (const auto sample = visibleSample(met_)) found_.push_back(pickedBy(int(*sample)));
      std::fill(done_.begin(), done_.end(), std::uint8_t(0));
    }
    return true;
  }

  std::size_t samples() const override {
    const auto undone = std::count(done_.begin(), done_.end(), std::uint8_t(0));
    return (at_ + 1) * done_.size() - std::size_t(undone);
  }

  const std::vector<Picked>& found() const override { return found_; }

 private:
  /// What a sample of the pixel has hit.
  Picked pickedBy(int sample) const {
    const kernel::FirstCollision& met = met_[std::size_t(sample)];
    const int column = sample % side_, row = sample / side_;
    const float x = float(column) + 0.5f, y = float(row) + 0.5f;
    const kernel::Ray ray = view_.rays(x, y);
    const float t = met.depth / view_.rays.depth(x, y, 1.0f);
    const glm::dvec3 voxel = glm::dvec3(ray.origin) + double(t) * glm::dvec3(ray.direction);
    return {glm::dvec3(plan_->grid().worldFromVoxel * glm::dvec4(voxel, 1)), voxel,
            plan_->visibleChannels()[std::size_t(met.channel)], start_ + double(met.depth)};
  }

  const std::shared_ptr<Launcher> launcher_;
  const std::shared_ptr<const RenderPlan> plan_;
  const Method method_;
  const kernel::SampleNumber number_;
  const std::vector<glm::ivec2> pixels_;
  const int side_;
  const bool isPoint_;
  const float unit_;  // distance between samples, in pixels; a power of two, so that it costs no precision
  kernel::SceneView view_;  // of the current pixel
  double start_ = 0;
  glm::vec2 halfSize_{0};  // of the picture
  std::size_t at_ = 0;
  std::vector<kernel::FirstCollision> met_;  // per sample of the current pixel
  std::vector<glm::vec4> colors_;
  std::vector<std::uint8_t> done_;
  std::vector<Picked> found_;
};

}  // namespace

std::unique_ptr<Picking> makePicking(std::shared_ptr<Launcher> launcher,
                                     std::shared_ptr<const RenderPlan> plan, const Scene& scene,
                                     const PixelArea& area) {
  return std::make_unique<SampledPicking>(std::move(launcher), std::move(plan), scene, area);
}

}  // namespace scolopax
