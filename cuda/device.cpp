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

Device::~Device() { tryToUse(); }

void Device::use() const { check(cudaSetDevice(index_), "choosing a device"); }

void Device::tryToUse() const {
  if (cudaSetDevice(index_) != cudaSuccess) cudaGetLastError();
}

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
  if (dropUnused()) return true;
  if (!release_ || !release_()) return false;
  use();  // what was released may have been on another device, too
  return true;
}

bool Device::dropUnused() {
  using Volumes = std::list<std::shared_ptr<DeviceVolume>>;
  Volumes volumes;
  {
    const std::lock_guard lock(mutex_);
    volumes = volumes_;
  }
  // Freed without the mutex, because that waits for the device.
  const bool dropped =
      std::any_of(volumes.rbegin(), volumes.rend(), [](const auto& volume) { return volume->dropUnused(); });
  volumes.clear();
  Volumes empty;  // likewise
  const std::lock_guard lock(mutex_);
  for (auto at = volumes_.begin(); at != volumes_.end();) {
    const auto volume = at++;
    if (volume->use_count() == 1 && (*volume)->isEmpty()) empty.splice(empty.end(), volumes_, volume);
  }
  return dropped;
}

std::size_t Device::capacity() const {
  std::size_t free = 0, total = 0;
  check(cudaMemGetInfo(&free, &total), "asking for the free memory");
  return free + memory_->reserved();
}

std::size_t Device::heldBytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& volume : volumes_) bytes += volume->heldBytes();
  return bytes;
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
  return std::make_unique<Band>(*memory_, cancelWatch_);
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
