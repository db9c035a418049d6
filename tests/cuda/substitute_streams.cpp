// SPDX-License-Identifier: Apache-2.0
// A substitute of the CUDA runtime for tests: streams, events, and the operations queued on streams.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <numeric>
#include <utility>

#include "tests/cuda/substitute_state.h"

using namespace substitute;

namespace {

/// The stream of a handle; null is the current device's default stream. Throws
/// Failure(cudaErrorInvalidResourceHandle) if there is none; otherwise as expectAlive().
CUstream_st& streamOf(cudaStream_t handle) {
  if (!handle) return currentDevice().defaultStream;
  for (const auto& stream : state().streams) {
    if (stream.get() != handle || stream->destroyed) continue;
    expectAlive(stream->device);
    return *stream;
  }
  throw Failure{cudaErrorInvalidResourceHandle};
}

auto placeOf(cudaEvent_t handle) {
  auto& all = state().events;
  const auto place =
      std::find_if(all.begin(), all.end(), [&](const auto& event) { return event.get() == handle; });
  if (place == all.end()) throw Failure{cudaErrorInvalidResourceHandle};
  return place;
}

/// The event of a handle; throws as streamOf().
CUevent_st& eventOf(cudaEvent_t handle) {
  CUevent_st& event = **placeOf(handle);
  expectAlive(event.device);
  return event;
}

/// The stream that a kernel is launched on.
CUstream_st& streamForLaunch(cudaStream_t handle) {
  CUstream_st& stream = streamOf(handle);
  currentDevice();
  if (stream.device != caller().device) throw Failure{cudaErrorInvalidResourceHandle};
  return stream;
}

/// What callBeforeBlock() has asked for.
struct Interlude {
  std::function<void()> f;
  std::atomic<std::size_t> blocksLeft = 0;
  /// Called by several threads.
  void countBlock() {
    std::size_t left = blocksLeft;
    while (left > 0 && !blocksLeft.compare_exchange_weak(left, left - 1)) continue;
    if (left == 1) f();
  }
};
Interlude& interlude() {
  static Interlude one;
  return one;
}

bool fits(dim3 grid, dim3 block) {
  if (std::max(block.x, block.y) > 1024 || block.z > 64) return false;
  const unsigned threads = block.x * block.y * block.z;
  return threads >= 1 && threads <= 1024 && grid.x >= 1 && grid.y >= 1 && grid.z >= 1 && grid.y <= 65535 &&
         grid.z <= 65535;
}

/// Whether a queued copy will read a part of this pinned memory.
bool isStillRead(std::span<const std::byte> memory) {
  return std::ranges::any_of(state().streams, [&](const auto& stream) {
    return std::ranges::any_of(stream->queue,
                               [&](const Operation& operation) { return overlap(operation.source, memory); });
  });
}

void removeFinishedStreams() {
  std::erase_if(state().streams,
                [](const auto& stream) { return stream->destroyed && stream->queue.empty(); });
}

}  // namespace

namespace substitute {

void callBeforeBlock(std::size_t n, std::function<void()> f) {
  locked([&] {
    interlude().f = std::move(f);
    interlude().blocksLeft = n;
  });
}

void runBlocks(dim3 grid, const std::function<void(uint3 blockIndex)>& runBlock) {
  std::vector<std::size_t> order(std::size_t(grid.x) * grid.y * grid.z);
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::shuffle(order.begin(), order.end(), state().random);
  // Isolated, because a thread that waits here must not start work that calls the runtime.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(std::size_t(0), order.size(), [&](std::size_t n) {
      const std::size_t i = order[n];
      interlude().countBlock();
      runBlock({unsigned(i % grid.x), unsigned(i / grid.x % grid.y), unsigned(i / grid.x / grid.y)});
    });
  });
}

cudaError_t launchKernel(cudaStream_t handle, dim3 grid, dim3 block, unsigned maxThreads, Kernel kernel) {
  return call([&] {
    CUstream_st& stream = streamForLaunch(handle);
    if (!kernel) throw Failure{cudaErrorInvalidDeviceFunction};
    if (!fits(grid, block)) throw Failure{cudaErrorInvalidConfiguration};
    if (block.x * block.y * block.z > maxThreads) throw Failure{cudaErrorInvalidValue};
    enqueue(stream, {.run = [device = stream.device, kernel = std::move(kernel)] {
              std::vector<Allocation> own = usableByKernels();
              std::erase_if(own, [&](const Allocation& allocation) { return allocation.device != device; });
              kernel(own);
            }});
  });
}

cudaError_t launchBlocks(cudaStream_t stream, dim3 grid, dim3 block,
                         std::function<void(uint3 blockIndex)> runBlock) {
  return launchKernel(stream, grid, block, 1024,
                      [grid, runBlock = std::move(runBlock)](auto) { runBlocks(grid, runBlock); });
}

cudaError_t launchHost(cudaStream_t stream, std::function<void()> function) {
  return call([&] { enqueue(streamForLaunch(stream), {.run = std::move(function)}); });
}

}  // namespace substitute

extern "C" {

cudaError_t cudaMemsetAsync(void* memory, int value, size_t sizeBytes, cudaStream_t handle) {
  return call([&] {
    CUstream_st& stream = streamOf(handle);
    if (sizeBytes == 0) return;
    expectOnDevice(memory, sizeBytes, stream.device);
    enqueue(stream, {.run = [=] { std::memset(memory, value, sizeBytes); }});
  });
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, size_t sizeBytes, cudaMemcpyKind kind,
                            cudaStream_t handle) {
  return call([&] {
    CUstream_st& stream = streamOf(handle);
    const bool upload = kind == cudaMemcpyHostToDevice;
    if (!upload && kind != cudaMemcpyDeviceToHost) throw Failure{cudaErrorInvalidMemcpyDirection};
    if (sizeBytes == 0) return;
    expectOnDevice(upload ? to : from, sizeBytes, stream.device);
    if (!allocationOf(state().pinnedMemory, upload ? from : to, sizeBytes))
      throw Failure{cudaErrorInvalidValue};

    Operation copy;
    copy.run = [=] {
      std::memcpy(to, from, sizeBytes);
      if (upload) state().bytesToDevice += sizeBytes;
    };
    copy.result = {static_cast<std::byte*>(to), sizeBytes};
    if (upload) copy.source = {static_cast<const std::byte*>(from), sizeBytes};
    // Only copies read pinned memory, so it can usually be poisoned at once, whatever else is queued.
    if (!upload && !isStillRead(copy.result)) std::memset(to, int(kPoison), sizeBytes);
    enqueue(stream, std::move(copy));
  });
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned flags) {
  return call([&] {
    currentDevice();
    if (flags & ~unsigned(cudaStreamNonBlocking)) throw Failure{cudaErrorInvalidValue};
    removeFinishedStreams();
    state().streams.push_back(
        std::make_unique<CUstream_st>(CUstream_st{caller().device, flags == cudaStreamNonBlocking}));
    *stream = state().streams.back().get();
  });
}

cudaError_t cudaStreamDestroy(cudaStream_t handle) {
  return release([&] {
    const auto& all = state().streams;
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& stream) {
      return stream.get() == handle && !stream->destroyed;
    });
    if (found == all.end()) throw Failure{cudaErrorInvalidResourceHandle};
    const int device = (*found)->device;
    (*found)->destroyed = true;
    removeFinishedStreams();
    expectAlive(device);
  });
}

cudaError_t cudaStreamSynchronize(cudaStream_t handle) {
  return call([&] {
    CUstream_st& stream = streamOf(handle);
    if (!handle) finishBlockingStreams(stream.device);
    finish(stream);
    surfaceFault(stream.device);
  });
}

cudaError_t cudaStreamQuery(cudaStream_t handle) {
  return call([&] {
    CUstream_st& stream = streamOf(handle);
    if (!stream.queue.empty()) step(stream);
    surfaceFault(stream.device);
    if (!stream.queue.empty()) throw Failure{cudaErrorNotReady};
  });
}

cudaError_t cudaStreamWaitEvent(cudaStream_t handle, cudaEvent_t event, unsigned flags) {
  return call([&] {
    CUstream_st& stream = streamOf(handle);
    const std::shared_ptr<Record> record = eventOf(event).record;
    if (flags != 0) throw Failure{cudaErrorInvalidValue};
    if (record) enqueue(stream, {.after = record});
  });
}

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned flags) {
  return call([&] {
    currentDevice();
    if (flags & ~unsigned(cudaEventBlockingSync | cudaEventDisableTiming))
      throw Failure{cudaErrorInvalidValue};
    state().events.push_back(
        std::make_unique<CUevent_st>(CUevent_st{caller().device, !(flags & cudaEventDisableTiming)}));
    *event = state().events.back().get();
  });
}

cudaError_t cudaEventDestroy(cudaEvent_t event) {
  return release([&] {
    const auto place = placeOf(event);
    const int device = (*place)->device;
    state().events.erase(place);
    expectAlive(device);
  });
}

cudaError_t cudaEventRecord(cudaEvent_t handle, cudaStream_t streamHandle) {
  return call([&] {
    CUevent_st& event = eventOf(handle);
    CUstream_st& stream = streamOf(streamHandle);
    if (event.device != stream.device) throw Failure{cudaErrorInvalidResourceHandle};
    event.record = std::make_shared<Record>(Record{&stream});
    enqueue(stream, {.reaches = event.record});
  });
}

cudaError_t cudaEventSynchronize(cudaEvent_t handle) {
  return call([&] {
    const CUevent_st& event = eventOf(handle);
    while (event.record && !event.record->reached) step(*event.record->stream);
    surfaceFault(event.device);
  });
}

cudaError_t cudaEventQuery(cudaEvent_t handle) {
  return call([&] {
    const CUevent_st& event = eventOf(handle);
    if (event.record && !event.record->reached) step(*event.record->stream);
    surfaceFault(event.device);
    if (event.record && !event.record->reached) throw Failure{cudaErrorNotReady};
  });
}

cudaError_t cudaEventElapsedTime(float* milliseconds, cudaEvent_t start, cudaEvent_t end) {
  return call([&] {
    const CUevent_st &from = eventOf(start), &to = eventOf(end);
    if (!from.timed || !to.timed || !from.record || !to.record || from.device != to.device)
      throw Failure{cudaErrorInvalidResourceHandle};
    if (!from.record->reached || !to.record->reached) throw Failure{cudaErrorNotReady};
    *milliseconds = std::chrono::duration<float, std::milli>(to.record->time - from.record->time).count();
  });
}

}  // extern "C"
