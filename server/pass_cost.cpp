// SPDX-License-Identifier: Apache-2.0
#include "server/pass_cost.h"

#include <algorithm>
#include <vector>

namespace scolopax::server {
namespace {

/// Factor by which the times of two passes may differ beyond the difference that their sizes explain.
constexpr double kDisturbed = 2;
/// Two sizes within this ratio say nothing about the slope.
constexpr double kApart = 1.2;

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

/// Whether a line without negative parts fits both passes within kDisturbed.
bool PassCost::agree(const Pass& a, const Pass& b) {
  const Pass& small = a.pixels <= b.pixels ? a : b;
  const Pass& large = a.pixels <= b.pixels ? b : a;
  return large.seconds * kDisturbed >= small.seconds &&
         large.seconds <= small.seconds * (large.pixels / small.pixels) * kDisturbed;
}

void PassCost::push(const Pass& pass) {
  if (count_ == kRecent) std::shift_left(passes_.begin(), passes_.end(), 1), --count_;
  passes_[count_++] = pass;
}

/// Forgets passes that contradict the last two: when the scene's cost changes, earlier passes are worthless.
void PassCost::forgetContradicted() {
  if (count_ < 3) return;
  const Pass last = passes_[count_ - 1], before = passes_[count_ - 2];
  if (!agree(last, before)) return;
  const auto end = passes_.begin() + std::ptrdiff_t(count_);
  const auto kept = std::remove_if(
      passes_.begin(), end - 2, [&](const Pass& pass) { return !agree(pass, last) && !agree(pass, before); });
  if (kept == end - 2) return;
  count_ = std::size_t(std::move(end - 2, end, kept) - passes_.begin());
  if (count_ == 2) fixed_ = 0;
}

void PassCost::fit() {
  const auto medianOf = [&](auto&& value) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count_; ++i) values.push_back(value(passes_[i]));
    return median(std::move(values));
  };
  std::vector<double> slopes;
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Pass &a = passes_[i], &b = passes_[j];
      if (std::max(a.pixels, b.pixels) >= kApart * std::min(a.pixels, b.pixels))
        slopes.push_back((a.seconds - b.seconds) / (a.pixels - b.pixels));
    }
  // Passes of a single size say nothing about the fixed part. It keeps its value, limited to the time of a
  // pass.
  if (slopes.empty()) {
    fixed_ = std::min(fixed_, medianOf([](const Pass& pass) { return pass.seconds; }));
  } else {
    const double slope = std::max(median(std::move(slopes)), 0.0);
    fixed_ = std::max(medianOf([&](const Pass& pass) { return pass.seconds - slope * pass.pixels; }), 0.0);
  }
  perPixel_ =
      std::max(medianOf([&](const Pass& pass) { return (pass.seconds - fixed_) / pass.pixels; }), 0.0);
}

void PassCost::add(std::uint64_t pixels, double seconds) {
  const Pass pass{double(std::max<std::uint64_t>(pixels, 1)), std::max(seconds, 0.0)};
  if (late_ && agree(*late_, pass)) push(*late_);
  late_.reset();
  push(pass);
  forgetContradicted();
  fit();
}

double PassCost::largestPixels() const {
  double largest = 0;
  for (std::size_t i = 0; i < count_; ++i) largest = std::max(largest, passes_[i].pixels);
  return largest;
}

bool PassCost::oneSize() const {
  return count_ == kRecent && std::all_of(passes_.begin(), passes_.end(),
                                          [&](const Pass& pass) { return pass.pixels == passes_[0].pixels; });
}

void PassCost::addUnfinished(std::uint64_t pixels, double seconds) {
  if (seconds > this->seconds(pixels)) late_ = Pass{double(std::max<std::uint64_t>(pixels, 1)), 2 * seconds};
}

double PassCost::seconds(std::uint64_t pixels) const {
  const double line = fixed_ + perPixel_ * double(pixels);
  return late_ ? std::max(line, late_->seconds * (double(pixels) / late_->pixels)) : line;
}

}  // namespace scolopax::server
