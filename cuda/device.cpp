// SPDX-License-Identifier: Apache-2.0
#include "cuda/device.h"

#include <algorithm>

#include "cuda/check.h"

namespace scolopax::cuda {
namespace {

/// Of a band's kernel. Two bands are under way at a time.
constexpr float kBandNs = 1.5e6f;
/// A warp's rows. Fewer would leave threads without work.
constexpr int kFewestRows = 4;

}  // namespace

Device::~Device() { cudaSetDevice(index_); }

void Device::use() const { check(cudaSetDevice(index_), "choosing a device"); }

std::shared_ptr<DeviceVolume> Device::volume(const std::shared_ptr<const Volume>& volume) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(volumes_.begin(), volumes_.end(),
                                  [&](const auto& each) { return each->volume() == volume; });
  if (found != volumes_.end())
    volumes_.splice(volumes_.begin(), volumes_, found);
  else
    volumes_.push_front(std::make_shared<DeviceVolume>(volume, *memory_, uploader_));
  return volumes_.front();
}

bool Device::makeRoom() {
  std::shared_ptr<DeviceVolume> oldest;  // released without the mutex
  const std::lock_guard lock(mutex_);
  for (auto at = volumes_.rbegin(); at != volumes_.rend(); ++at)
    if (at->use_count() == 1) {
      oldest = std::move(*at);
      volumes_.erase(std::next(at).base());
      return true;
    }
  return false;
}

std::unique_ptr<Band> Device::takeBand() {
  {
    const std::lock_guard lock(mutex_);
    if (!bands_.empty()) {
      auto band = std::move(bands_.back());
      bands_.pop_back();
      return band;
    }
  }
  return std::make_unique<Band>(*memory_);
}

void Device::giveBack(std::unique_ptr<Band> band) {
  const std::lock_guard lock(mutex_);
  bands_.push_back(std::move(band));
}

int Device::rowsOf(int width, int height) const {
  const auto pixels = std::size_t(kBandNs / nsPerPixel_);
  const int rows = int(std::min(pixels, Band::kMaxPixels) / std::size_t(width));
  return std::clamp(rows / kFewestRows * kFewestRows, kFewestRows, std::max(height, kFewestRows));
}

void Device::tookMs(float ms, std::size_t pixels) {
  const float ns = ms * 1e6f / float(pixels);
  nsPerPixel_ = 0.5f * nsPerPixel_ + 0.5f * std::max(ns, 1e-3f);
}

}  // namespace scolopax::cuda
