// SPDX-License-Identifier: Apache-2.0
// Owner of linear device memory.
#pragma once
#include <cstddef>
#include <span>
#include <utility>

#include "cuda/check.h"

namespace scolopax::cuda {

/// `count` objects of T on the device; move-only. T is copied byte by byte. An empty buffer allocates no
/// memory.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  /// Leaves the memory uninitialised. Throws Error(tooLarge) if it cannot be allocated.
  explicit DeviceBuffer(std::size_t count) : count_(count) {
    void* memory = nullptr;
    if (count > 0) check(cudaMalloc(&memory, count * sizeof(T)), "allocating device memory");
    data_ = static_cast<T*>(memory);
  }
  explicit DeviceBuffer(std::span<const T> host) : DeviceBuffer(host.size()) {
    if (count_ > 0)
      check(cudaMemcpy(data_, host.data(), host.size_bytes(), cudaMemcpyHostToDevice),
            "copying to the device");
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(count_, other.count_);
    return *this;
  }
  ~DeviceBuffer() { cudaFree(data_); }

  T* data() const { return data_; }
  std::size_t count() const { return count_; }
  void fillWithZeros() {
    if (count_ > 0) check(cudaMemset(data_, 0, count_ * sizeof(T)), "clearing device memory");
  }
  /// Waits for kernels launched before. host.size() must be count().
  void copyTo(std::span<T> host) const {
    if (count_ > 0)
      check(cudaMemcpy(host.data(), data_, host.size_bytes(), cudaMemcpyDeviceToHost),
            "copying from the device");
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

}  // namespace scolopax::cuda
