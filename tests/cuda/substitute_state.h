// SPDX-License-Identifier: Apache-2.0
// Shared by the files of the substitute runtime. Device memory is host memory with known bounds. Work on a
// stream stays in a queue until something waits for it. Then it runs in the calling thread.
//
// It is stricter than CUDA in these ways, on which launchers should not rely:
// - asynchronous copies need pinned memory (cudaHostAlloc);
// - device memory is used by its own device only, and so is pinned memory, by kernels, if it is mapped at
// all;
// - streams and events that nobody waits for make no progress;
// - cudaErrorNotReady becomes the last error, as others do.
#pragma once
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <random>

#include "tests/cuda/substitute_runtime.h"

namespace substitute {

/// Thrown to end a call of the runtime, which returns the error.
struct Failure {
  cudaError_t error;
};

/// A position in a stream's queue, marked by cudaEventRecord.
struct Record {
  CUstream_st* stream;  ///< valid until it is reached
  bool reached = false;
  std::chrono::steady_clock::time_point time{};
};

/// Work in a stream's queue. Every member may be empty.
struct Operation {
  std::function<void()> run{};
  std::shared_ptr<Record> after{};      ///< must be reached first
  std::shared_ptr<Record> reaches{};    ///< reached when this has run
  std::span<const std::byte> source{};  ///< pinned memory that it reads
  /// Poisoned when the operation becomes the next in its stream, not earlier, because earlier operations may
  /// read it.
  std::span<std::byte> result{};
};

}  // namespace substitute

struct CUstream_st {
  int device;
  bool nonBlocking = true;  ///< it and the default stream do not wait for each other
  bool destroyed = false;   ///< lives until its queue is empty
  std::deque<substitute::Operation> queue{};
};

struct CUevent_st {
  int device;
  bool timed;
  std::shared_ptr<substitute::Record> record{};  ///< the last one
};

namespace substitute {

struct Device {
  explicit Device(int number, std::size_t limitBytes) : defaultStream{number}, limit(limitBytes) {}
  CUstream_st defaultStream;  ///< its queue is empty between calls
  std::size_t used = 0, limit;
  bool lost = false;
};

struct Memory {
  std::size_t sizeBytes;
  int device;
  bool mapped = false;  ///< pinned memory that kernels on the device may use
};
using Heap = std::map<const std::byte*, Memory>;  ///< by address

struct State {
  std::deque<Device> devices;  ///< at least deviceCount, so that objects on them can be freed
  int deviceCount = 1;
  cudaError_t deviceCountResult = cudaSuccess;
  std::size_t limit = std::size_t(1) << 32;  ///< of devices added later
  Heap deviceMemory, pinnedMemory;
  std::vector<std::unique_ptr<CUstream_st>> streams;
  std::vector<std::unique_ptr<CUevent_st>> events;
  std::size_t calls = 0, failingCall = 0;
  cudaError_t failure = cudaSuccess;
  std::size_t bytesToDevice = 0, freesThatWaited = 0;
  std::mt19937 random{1};  ///< chooses the order of blocks and streams
};

/// To be used only within call(), release() and locked().
State& state();

/// Runs a call of the runtime: counts it, and lets it fail if a test has requested that. Calls run one at a
/// time. Returns the Failure that the body throws, and stores it as the thread's last error.
cudaError_t call(const std::function<void()>& body);
/// The same for calls that free something: the body runs even if the call must fail.
cudaError_t release(const std::function<void()>& body);
/// Runs code that is not a call of the runtime, but must not run at the same time as one.
void locked(const std::function<void()>& body);

/// The state of each thread.
struct Caller {
  unsigned epoch = 0;  ///< number of resets that the thread has seen
  int device = 0;
  cudaError_t lastError = cudaSuccess;
};
Caller& caller();

/// Throws Failure(cudaErrorIllegalAddress) if the device is lost.
void expectAlive(int device);
/// Throws Failure(cudaErrorInvalidDevice) if there is no such device; otherwise as expectAlive().
Device& deviceOf(int number);
/// The calling thread's device; throws as deviceOf().
Device& currentDevice();
/// Throws Failure(cudaErrorIllegalAddress) once after a fault.
void surfaceFault(int device);

/// The allocation that contains all of these bytes; null if there is none.
const Memory* allocationOf(const Heap& heap, const void* memory, std::size_t sizeBytes);
/// All allocations that some kernel may use.
std::vector<Allocation> usableByKernels();
/// Throws Failure(cudaErrorInvalidValue) unless one allocation on the device contains all of these bytes.
void expectOnDevice(const void* memory, std::size_t sizeBytes, int device);

bool overlap(std::span<const std::byte> a, std::span<const std::byte> b);

/// Work on a default stream runs at once.
void enqueue(CUstream_st& stream, Operation operation);
/// Runs one operation: the stream's next one, or one for which it waits. The queue must not be empty.
void step(CUstream_st& stream);
/// Runs all queued operations, and those for which they wait.
void finish(CUstream_st& stream);
/// The same for all streams of a device, in turns. Returns whether anything was queued.
bool finishDevice(int device);
/// Runs the queued copies that use this pinned memory, and all operations before them. Returns whether there
/// were any.
bool finishUsersOf(std::span<const std::byte> pinned);
/// The streams for which the default stream waits: all except non-blocking ones.
void finishBlockingStreams(int device);
void reach(Record& record);

}  // namespace substitute
