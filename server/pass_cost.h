// SPDX-License-Identifier: Apache-2.0
// What a pass over a picture costs by its size, learnt from the passes before it. Used by ResolutionPolicy.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace scolopax::server {

/// seconds = fixed + perPixel * pixels: a line through recent passes, neither part negative. A pass that was
/// disturbed hardly moves it; two in a row that agree and contradict older ones replace them.
class PassCost {
 public:
  /// A pass over `pixels` (above 0) took `seconds` (0 or more).
  void add(std::uint64_t pixels, double seconds);
  /// A pass was given up after `seconds`. Longer than expected: it is taken to have been half done, until the
  /// next pass that ends tells.
  void addUnfinished(std::uint64_t pixels, double seconds);
  /// Whether seconds() says anything.
  bool known() const { return count_ > 0 || late_; }
  /// What is to be expected of a pass over `pixels`; 0 where nothing is known.
  double seconds(std::uint64_t pixels) const;
  /// Of the largest recent picture; 0 where there is none. Beyond it the line is a guess.
  double largestPixels() const;
  /// Whether all passes that are remembered, as many as can be, were of one size: the fixed part is not
  /// known.
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

  std::array<Pass, kRecent> passes_{};  ///< the newest last
  std::size_t count_ = 0;
  std::optional<Pass> late_;  ///< given up, and slower than the line
  double fixed_ = 0, perPixel_ = 0;
};

}  // namespace scolopax::server
