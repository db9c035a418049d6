// SPDX-License-Identifier: Apache-2.0
#include "cuda/uploader.h"

#include <algorithm>

#include "cuda/check.h"

namespace scolopax::cuda {

Uploader::~Uploader() {
  if (stream_) cudaStreamSynchronize(stream_);
  for (const Piece& piece : pieces_) {
    if (piece.sent) cudaEventDestroy(piece.sent);
    cudaFreeHost(piece.memory);
  }
  if (stream_) cudaStreamDestroy(stream_);
}

void Uploader::prepare() {
  if (!stream_) check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream");
  for (Piece& piece : pieces_) {
    if (!piece.memory) {
      void* memory = nullptr;
      check(cudaHostAlloc(&memory, kPieceBytes, cudaHostAllocDefault), "allocating pinned memory");
      piece.memory = static_cast<std::byte*>(memory);
    }
    if (!piece.sent)
      check(cudaEventCreateWithFlags(&piece.sent, cudaEventBlockingSync | cudaEventDisableTiming),
            "creating an event");
  }
}

std::size_t Uploader::copy(std::byte* device, std::size_t bytes, std::size_t begin, const Gather& gather,
                           const std::function<bool()>& stop) {
  while (begin < bytes && !stop()) {
    const std::lock_guard turn(mutex_);  // for one piece, so that a small copy does not wait for a volume
    prepare();
    const Piece& piece = pieces_[next_];
    next_ = 1 - next_;
    check(cudaEventSynchronize(piece.sent), "copying to the device");
    const std::size_t count = std::min(kPieceBytes, bytes - begin);
    gather(piece.memory, begin, count);
    check(cudaMemcpyAsync(device + begin, piece.memory, count, cudaMemcpyHostToDevice, stream_),
          "copying to the device");
    check(cudaEventRecord(piece.sent, stream_), "copying to the device");
    begin += count;
  }
  if (stream_) check(cudaStreamSynchronize(stream_), "copying to the device");
  return begin;
}

}  // namespace scolopax::cuda
