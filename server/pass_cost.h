// SPDX-License-Identifier: Apache-2.0
// Predicts the time of a sample pass from the picture's size, by earlier passes. Used by ResolutionPolicy.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace scolopax::server {

/// seconds = fixed + perPixel * pixels: a line fitted to recent passes, with neither part negative. A single
/// outlier hardly changes it. Two consecutive passes that agree replace the older ones that contradict them.
class PassCost {
 public:
  /// Records that a pass over `pixels` (above 0) took `seconds` (0 or more).
  void add(std::uint64_t pixels, double seconds);
  /// Records that a pass was abandoned after `seconds`. If that is longer than expected, the pass is assumed
  /// to have been half done, until the next complete pass.
  void addUnfinished(std::uint64_t pixels, double seconds);
  /// Whether any pass has been recorded.
  bool known() const { return count_ > 0 || late_; }
  /// The expected time of a pass over `pixels`; 0 if nothing is known.
  double seconds(std::uint64_t pixels) const;
  /// Pixels of the largest recent picture; 0 if there is none. For larger pictures the line is an
  /// extrapolation.
  double largestPixels() const;
  /// Whether all kRecent recorded passes had the same size. Then the fixed part is not known.
  bool oneSize() const;
  double fixedSeconds() const { return fixed_; }
  double secondsPerPixel() const { return perPixel_; }

 private:
  struct Pass {
    double pixels, seconds;
  };
  static constexpr std::size_t kRecent = 8;

  static bool agree(const Pass& a, const Pass& b);
  void push(const Pass& pass);
  void forgetContradicted();
  void fit();

  std::array<Pass, kRecent> passes_{};  ///< the newest is the last
  std::size_t count_ = 0;
  std::optional<Pass> late_;  ///< an abandoned pass that was slower than the line
  double fixed_ = 0, perPixel_ = 0;
};

}  // namespace scolopax::server
