// SPDX-License-Identifier: Apache-2.0
// Small pictures of a plan's scene at several resolutions of quadrature, from which its bias and noise are
// estimated.
#pragma once
#include <atomic>
#include <glm/vec4.hpp>
#include <stop_token>
#include <vector>

#include "renderer/data/render_plan.h"
#include "renderer/data/resolution.h"
#include "renderer/launcher.h"

namespace scolopax {

/// Longer side of a thumbnail, in pixels; the second is for scenes with shading or shadows.
inline constexpr int kThumbnailSide = 24, kLitThumbnailSide = 16;

/// Independent samples of one thumbnail. Sample s has the same random numbers at every resolution, and so
/// nearly the same noise.
struct Pictures {
  Resolution resolution;
  double fetches = 0;  ///< per ray; for trackers, of which one costs more
  std::vector<std::vector<glm::vec4>> samples;
};

class Thumbnails {
 public:
  /// Borrows the launcher and the plan. Rays go through the centres of the thumbnail's pixels or, if
  /// `spread`, are spread over as much as a pixel of the picture covers with the scene's filter.
  Thumbnails(Launcher& launcher, const RenderPlan& plan, Method method, bool spread,
             const std::stop_token& stop);

  /// `count` samples. Throws Error(cancelled) once a stop is requested. For trackers, the resolution does not
  /// matter.
  Pictures render(const Resolution& resolution, std::size_t count);
  std::uint64_t rays() const { return rays_; }

 private:
  struct RaiseFlag {
    std::atomic<bool>* flag;
    void operator()() const { *flag = true; }
  };
  Launcher& launcher_;
  const RenderPlan& plan_;
  const Method method_;
  kernel::SceneView view_;
  std::uint64_t rays_ = 0;
  std::atomic<bool> stopped_{false};
  std::stop_callback<RaiseFlag> onStop_;
};

/// An estimate, and its standard deviation from the spread of the pixels.
struct Estimate {
  double value, deviation;
};

/// Mean over pixels and components of the squared difference between the expected pictures of two
/// resolutions. Computed from products of different samples, in which noise cancels out; needs two samples.
Estimate squaredDifference(const Pictures& a, const Pictures& b);
/// Mean over pixels and components of the variance of a sample.
double variance(const Pictures& pictures);
/// The same for the difference of samples of two resolutions.
double varianceOfDifference(const Pictures& a, const Pictures& b);

}  // namespace scolopax
