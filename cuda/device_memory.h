// SPDX-License-Identifier: Apache-2.0
// Memory of one device. Blocks that are given back are kept for later: freeing memory waits for all kernels
// on the device, whichever session they belong to.
#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

namespace scolopax::cuda {

using DeviceBytes = std::shared_ptr<std::byte>;

/// Every function may be called from any thread; the device must be the calling thread's current one.
class DeviceMemory : public std::enable_shared_from_this<DeviceMemory> {
 public:
  /// `makeRoom` is called without locks when memory is short: it gives back what can be uploaded again, and
  /// returns whether there was any.
  explicit DeviceMemory(std::function<bool()> makeRoom) : makeRoom_(std::move(makeRoom)) {}
  DeviceMemory(const DeviceMemory&) = delete;
  DeviceMemory& operator=(const DeviceMemory&) = delete;
  ~DeviceMemory();

  /// Uninitialised memory, aligned for any type; null for no bytes. Throws Error(tooLarge) if there is not
  /// enough. Kernels that use a block must have completed when its last owner gives it up.
  DeviceBytes allocate(std::size_t bytes);
  /// Bytes of all blocks: those in use, and those kept for later.
  std::size_t reserved() const;

 private:
  void giveBack(std::byte* block, std::size_t bytes);
  bool freeKept();

  const std::function<bool()> makeRoom_;
  mutable std::mutex mutex_;
  std::multimap<std::size_t, std::byte*> kept_;  // by size
  std::size_t keptBytes_ = 0, used_ = 0;
};

}  // namespace scolopax::cuda
