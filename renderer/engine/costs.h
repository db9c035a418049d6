// SPDX-License-Identifier: Apache-2.0
// Sums up what the rays of passes cost.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "renderer/kernel/sample_records.h"
#include "renderer/renderer.h"

namespace scolopax {

class Costs {
 public:
  /// Forgets all costs. Pass 0 pixels to count nothing. Throws std::bad_alloc.
  void reset(std::size_t pixels);
  static constexpr std::size_t kPixelBytes = sizeof(kernel::SampleCost);

  /// Costs of the passes since add(), one per pixel, as in Pass; null if nothing is counted.
  kernel::SampleCost* pass() { return pass_.empty() ? nullptr : pass_.data(); }
  /// Moves the costs of the passes into sums, which do not overflow. `fetches`, if given, takes each pixel's.
  void add(std::uint64_t* fetches = nullptr);
  /// `rays` is the number of pixels at all calls of add().
  const RenderStats& sums() const { return sums_; }

 private:
  std::vector<kernel::SampleCost> pass_;
  RenderStats sums_;
};

/// The costs of both; of `work`, not its rays.
RenderStats withWork(RenderStats stats, const RenderStats& work);

}  // namespace scolopax
