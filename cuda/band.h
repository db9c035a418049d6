// SPDX-License-Identifier: Apache-2.0
// Renders a band of a picture on a stream of its own: starts a kernel, copies what it has rendered to pinned
// memory, and hands it over once that is complete.
#pragma once
#include <cuda_runtime_api.h>

#include <atomic>
#include <glm/vec4.hpp>

#include "cuda/cancel_watch.h"
#include "cuda/device_memory.h"
#include "cuda/launch.h"
#include "renderer/launcher.h"

namespace scolopax::cuda {

/// The device must be the calling thread's current one, in the destructor too.
class Band {
 public:
  /// Most pixels of a band: at least eight rows of the widest picture.
  static constexpr std::size_t kMaxPixels = std::size_t{1} << 17;

  /// `memory`: of the device. Throws Error(tooLarge).
  Band(DeviceMemory& memory, CancelWatch& watch);
  /// Allocates what start() needs for a pass with these records. Throws Error(tooLarge).
  void prepare(bool cost, bool first);
  Band(const Band&) = delete;
  Band& operator=(const Band&) = delete;
  ~Band();  ///< ends the kernel, if it runs, and waits for the stream

  /// Starts rendering rows of a pass; `scene` is its view in device memory. `rows` times the width must be at
  /// most kMaxPixels.
  void start(const Pass& pass, const kernel::SceneView& scene, int firstRow, int rows);
  /// Waits until the rows are rendered, and moves them into the arrays of the pass. Returns false, and moves
  /// nothing, if rays may have ended early, because the pass was cancelled.
  bool finish(const Pass& pass);
  int rows() const { return band_.rows; }
  /// Time that the kernel took, in ms; known after finish().
  float kernelMs() const { return kernelMs_; }

 private:
  template <class T>
  struct Results {
    DeviceBytes memory;
    T* host = nullptr;
    T* device() const { return reinterpret_cast<T*>(memory.get()); }
    void allocate(DeviceMemory& from);
    void receive(std::size_t count, cudaStream_t stream);
  };
  void allocateFlag();
  void freeAll();

  DeviceMemory& memory_;
  CancelWatch& watch_;
  cudaStream_t stream_ = nullptr;
  cudaEvent_t begun_ = nullptr, rendered_ = nullptr, received_ = nullptr;
  Results<glm::vec4> pixels_;
  Results<kernel::SampleCost> cost_;                      // allocated when first needed
  Results<kernel::FirstCollision> first_;                 // likewise
  std::atomic<bool>* cancelled_ = nullptr;                // in pinned memory: kernels read it
  const std::atomic<bool>* cancelledOnDevice_ = nullptr;  // its address there
  DeviceBand band_{};
  float kernelMs_ = 0;
};

}  // namespace scolopax::cuda
