// SPDX-License-Identifier: Apache-2.0
#include "cuda/band.h"

#include <algorithm>
#include <new>

#include "cuda/check.h"

namespace scolopax::cuda {

static_assert(Band::kMaxPixels >= std::size_t(kMaxImageSide) * 8);

template <class T>
void Band::Results<T>::allocate(DeviceMemory& from) {
  if (host) return;
  if (!memory) memory = from.allocate(kMaxPixels * sizeof(T));
  void* pinned = nullptr;
  check(cudaHostAlloc(&pinned, kMaxPixels * sizeof(T), cudaHostAllocDefault), "allocating pinned memory");
  host = static_cast<T*>(pinned);
}

template <class T>
void Band::Results<T>::receive(std::size_t count, cudaStream_t stream) {
  check(cudaMemcpyAsync(host, device(), count * sizeof(T), cudaMemcpyDeviceToHost, stream),
        "copying from the device");
}

Band::Band(DeviceMemory& memory, CancelWatch& watch) : memory_(memory), watch_(watch) {
  try {
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream");
    for (cudaEvent_t* event : {&begun_, &rendered_})
      check(cudaEventCreateWithFlags(event, cudaEventDefault), "creating an event");
    check(cudaEventCreateWithFlags(&received_, cudaEventBlockingSync | cudaEventDisableTiming),
          "creating an event");
    pixels_.allocate(memory_);
    allocateFlag();
  } catch (...) {
    freeAll();
    throw;
  }
}

Band::~Band() {
  watch_.remove(*cancelled_);
  *cancelled_ = true;
  cudaStreamSynchronize(stream_);
  freeAll();
}

void Band::allocateFlag() {
  void *flag = nullptr, *onDevice = nullptr;
  check(cudaHostAlloc(&flag, sizeof *cancelled_, cudaHostAllocMapped), "allocating pinned memory");
  cancelled_ = new (flag) std::atomic<bool>(false);
  check(cudaHostGetDevicePointer(&onDevice, flag, 0), "mapping pinned memory");
  cancelledOnDevice_ = static_cast<const std::atomic<bool>*>(onDevice);
}

void Band::freeAll() {
  for (void* pinned : {static_cast<void*>(pixels_.host), static_cast<void*>(cost_.host),
                       static_cast<void*>(first_.host), static_cast<void*>(cancelled_)})
    if (pinned) cudaFreeHost(pinned);
  for (const cudaEvent_t event : {begun_, rendered_, received_})
    if (event) cudaEventDestroy(event);
  if (stream_) cudaStreamDestroy(stream_);
}

void Band::prepare(bool cost, bool first) {
  if (cost) cost_.allocate(memory_);
  if (first) first_.allocate(memory_);
}

void Band::start(const Pass& pass, const kernel::SceneView& scene, int firstRow, int rows) {
  band_ = {.scene = scene,
           .number = pass.number,
           .firstRow = firstRow,
           .rows = rows,
           .pixels = pixels_.device(),
           .cost = pass.cost ? cost_.device() : nullptr,
           .first = pass.first ? first_.device() : nullptr};
  band_.scene.cancel = cancelledOnDevice_;
  *cancelled_ = false;
  watch_.add(*pass.cancel, *cancelled_);
  const std::size_t count = std::size_t(rows) * std::size_t(scene.width);
  const LaunchFunction launch =
      chooseLaunch(instanceOf(pass.method, pass.plan->scene().blend, pass.scene), band_, pass.scene.channels);
  if (pass.cost)
    check(cudaMemsetAsync(cost_.device(), 0, count * sizeof(kernel::SampleCost), stream_),
          "clearing device memory");
  check(cudaEventRecord(begun_, stream_), "starting a kernel");
  check(launch(band_, stream_), "starting a kernel");
  check(cudaEventRecord(rendered_, stream_), "starting a kernel");
  pixels_.receive(count, stream_);
  if (pass.cost) cost_.receive(count, stream_);
  if (pass.first) first_.receive(count, stream_);
  check(cudaEventRecord(received_, stream_), "starting a kernel");
}

bool Band::finish(const Pass& pass) {
  check(cudaEventSynchronize(received_), "rendering");
  watch_.remove(*cancelled_);
  if (*cancelled_) return false;
  check(cudaEventElapsedTime(&kernelMs_, begun_, rendered_), "rendering");
  const std::size_t begin = std::size_t(band_.firstRow) * std::size_t(band_.scene.width);
  const std::size_t count = std::size_t(band_.rows) * std::size_t(band_.scene.width);
  std::copy_n(pixels_.host, count, pass.pixels + begin);
  if (pass.first) std::copy_n(first_.host, count, pass.first + begin);
  for (std::size_t i = 0; pass.cost && i < count; ++i) kernel::addCost(&pass.cost[begin + i], cost_.host[i]);
  std::fill_n(pass.done + begin, count, std::uint8_t(1));
  return true;
}

}  // namespace scolopax::cuda
