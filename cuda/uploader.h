// SPDX-License-Identifier: Apache-2.0
// Copies memory to a device in pieces, through pinned memory: while one piece is on its way, the next is
// gathered.
#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <functional>

#include "cuda/fair_mutex.h"

namespace scolopax::cuda {

/// Every function may be called from any thread; the device must be the calling thread's current one.
class Uploader {
 public:
  /// Writes bytes [offset, offset + count) of what is to be copied to `piece`.
  using Gather = std::function<void(std::byte* piece, std::size_t offset, std::size_t count)>;

  Uploader() = default;
  Uploader(const Uploader&) = delete;
  Uploader& operator=(const Uploader&) = delete;
  ~Uploader();

  /// Copies bytes [begin, bytes) to `device` + begin. Between pieces, ends early if `stop` returns true.
  /// Returns the end of what was copied; it has arrived.
  std::size_t copy(
      std::byte* device, std::size_t bytes, std::size_t begin, const Gather& gather,
      const std::function<bool()>& stop = [] { return false; });

  static constexpr std::size_t kPieceBytes = std::size_t{4} << 20;

 private:
  struct Piece {
    std::byte* memory = nullptr;
    cudaEvent_t sent = nullptr;  // recorded behind the piece's last copy
  };
  void prepare();

  FairMutex mutex_;
  cudaStream_t stream_ = nullptr;
  Piece pieces_[2];
  int next_ = 0;
};

}  // namespace scolopax::cuda
