// SPDX-License-Identifier: Apache-2.0
// Small pictures of a plan's scene at several resolutions of quadrature, from which its bias and noise are
// estimated.
#pragma once
#include <atomic>
#include <cstdint>
#include <glm/vec4.hpp>
#include <optional>
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
  /// `spread`, are spread over as much as a pixel of the picture covers with the scene's filter. `mostWork`:
  /// fetches and visits of macrocells that all thumbnails together may take. A count, not a time, so that a
  /// scene has the same result on every machine.
  Thumbnails(Launcher& launcher, const RenderPlan& plan, Method method, bool spread, std::uint64_t mostWork,
             const std::stop_token& stop);

  /// `count` samples; nullopt, soon after, if that takes more work than is left. Throws Error(cancelled) once
  /// a stop is requested. For trackers, the resolution does not matter.
  std::optional<Pictures> render(const Resolution& resolution, std::size_t count);
  std::uint64_t rays() const { return rays_; }

 private:
  struct RaiseFlag {
    std::atomic<bool>* flag;
    void operator()() const { *flag = true; }
  };
  /// Fetches and visits of macrocells.
  struct Work {
    std::uint64_t fetches = 0, cellSteps = 0;
    std::uint64_t all() const { return fetches + cellSteps; }
  };
  int rowsAtOnce() const;
  Work renderRows(std::uint32_t sample, int firstRow, int rows, std::vector<glm::vec4>& pixels);

  Launcher& launcher_;
  const RenderPlan& plan_;
  const Method method_;
  const std::uint64_t mostWork_;
  kernel::SceneView view_;
  std::uint64_t rays_ = 0;
  std::uint64_t work_ = 0;       // so far
  std::uint64_t workOfRow_ = 0;  // the most that a row has taken so far
  std::vector<kernel::SampleCost> cost_;
  std::vector<std::uint8_t> done_;  // as in Pass
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
