// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/loading.h"

#include <unistd.h>

#include <algorithm>
#include <limits>

#include "renderer/core/error.h"

namespace scolopax::io {

std::uint64_t defaultMemoryLimitBytes() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), pageBytes = ::sysconf(_SC_PAGE_SIZE);
  if (pages <= 0 || pageBytes <= 0) return std::uint64_t(1) << 32;
  return std::uint64_t(pages) * std::uint64_t(pageBytes) / 2;
}

std::string byteCount(std::uint64_t bytes) {
  return bytes == std::numeric_limits<std::uint64_t>::max() ? "more than 2^64 bytes"
                                                            : std::to_string(bytes) + " bytes";
}

Loading::Loading(LoadOptions options, std::uint64_t allBytes) : options_(std::move(options)) {
  progress_.allBytes = allBytes;
  report();
}

void Loading::report() {
  reportedBytes_ = progress_.doneBytes;
  if (options_.progress) options_.progress(progress_);
}

void Loading::warn(const std::string& line) {
  const std::lock_guard lock(mutex_);
  if (options_.warn && said_.insert(line).second) options_.warn(line);
}

void Loading::checkStop() const {
  if (options_.stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
}

void Loading::advance(std::uint64_t bytes) {
  checkStop();
  const std::lock_guard lock(mutex_);
  // Never more than all: a reader may write a voxel twice.
  progress_.doneBytes = std::min(progress_.doneBytes + bytes, progress_.allBytes);
  if (progress_.doneBytes - reportedBytes_ > progress_.allBytes / 256) report();
}

void Loading::begin(std::string_view stage) {
  checkStop();
  const std::lock_guard lock(mutex_);
  progress_.stage = stage;
  progress_.doneBytes = progress_.allBytes;
  report();
}

void Loading::checkMemory(const std::string& what, std::uint64_t bytes) const {
  if (bytes <= options_.memoryLimitBytes) return;
  throw Error(ErrorCode::tooLarge, what + " needs " + byteCount(bytes) + " of memory, the limit is " +
                                       byteCount(options_.memoryLimitBytes));
}

}  // namespace scolopax::io
