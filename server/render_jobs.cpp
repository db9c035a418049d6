// SPDX-License-Identifier: Apache-2.0
#include "server/render_jobs.h"

#include <cmath>
#include <utility>
#include <vector>

#include "renderer/data/aov.h"
#include "server/blend.h"
#include "server/resolution.h"

namespace scolopax::server {
namespace {

/// Step of quadrature while edits arrive, in smallest voxel spacings.
constexpr double kInteractiveStep = 2;

}  // namespace

Scene drawnScene(const ResolvedScene& resolved, double divisor, bool interactive) {
  Scene scene = atDivisor(resolved.render, divisor);
  if (interactive && scene.method == Method::automatic) {
    scene.method = Method::hybrid;
    scene.step = kInteractiveStep;
  }
  return scene;
}

void SceneBuild::run(const std::stop_token& stop) {
  previous.reset();
  if (!volume) volume = request.scene->dataset->load(request.scene->time, stop);
  if (!renderer) renderer = make(volume);
  stats = renderer->setScene(scene, stop);
  if (record) renderer->recordAovs();
}

void RenderPart::run(const std::stop_token& stop) {
  const std::stop_callback stopped(stop, [this] { cancel_ = true; });
  runUntil(cancel_);
}

void RenderPart::run(PassInterrupter& interrupter, bool urgent) {
  const PassInterrupter::Watched watched(interrupter, now_() + slice_ + kSlowRay);
  runUntil(interrupter.flag(urgent));
}

void RenderPart::runUntil(const std::atomic<bool>& cancel) {
  const TimePoint begin = now_();
  complete_ = render_(cancel, slice_);
  interrupted_ = !complete_ && cancel;
  seconds_ = std::chrono::duration<double>(now_() - begin).count();
}

void SampleAddition::run(const std::stop_token&) {
  renderer->addPixels();
  // Makes the error known when it is needed. If estimating it takes long, PictureJob does it.
  if (estimate && !renderer->errorTakesLong()) renderer->estimatedError();
}

void PictureJob::run(const std::stop_token& stop) {
  FrameInfo& info = frame.info;
  info.error = float(renderer->estimatedError(stop));
  const auto take = [&](std::size_t pixelBytes) {
    return MemoryBudget::take(memory, MemoryUse::pictures, pixels * pixelBytes);
  };
  // Blending makes a second image from the reduced picture.
  auto imageMemory = take(sizeof(glm::vec4) * (reduced ? 2 : 1));
  auto aovMemory = take(aovs ? std::size(kAovs) * sizeof(float) : 0);
  Image picture = renderer->image();
  if (reduced) {
    // If the error is not known although there are samples enough, the picture is shown as it is.
    const double error = info.samples < 2 ? sampleError : std::isnan(info.error) ? 0 : double(info.error);
    share = mixIn(enlarged(*reduced, picture.width, picture.height), error, &picture);
    info.mixed = true;
  }
  imageMemory.resize(pixels * sizeof(glm::vec4));
  frame.image = withShare(std::move(imageMemory), std::move(picture));
  if (!aovs) return;
  std::vector<AovValues> values;
  for (std::size_t i = 0; i < std::size(kAovs); ++i) values.push_back(renderer->aov(Aov(i)));
  frame.aovs = withShare(std::move(aovMemory), std::move(values));
}

}  // namespace scolopax::server
