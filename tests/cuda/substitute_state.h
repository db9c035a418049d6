// SPDX-License-Identifier: Apache-2.0
// What the files of the substitute runtime share. Device memory is host memory with bounds that are known.
// Work on a stream waits in a queue until something waits for it: then it runs in the calling thread.
//
// It is stricter than CUDA where launchers should not rely on more:
// - asynchronous copies need pinned memory (cudaHostAlloc);
// - device memory is used by its own device only;
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

/// Ends a call of the runtime, which returns the error.
struct Failure {
  cudaError_t error;
};

/// A place in a stream's queue, marked by cudaEventRecord.
struct Record {
  CUstream_st* stream;  ///< valid until it is reached
  bool reached = false;
  std::chrono::steady_clock::time_point time{};
};

/// Work in a stream's queue. Every member may be empty.
struct Operation {
  std::function<void()> run{};
  std::shared_ptr<Record> after{};      ///< has to be reached first
  std::shared_ptr<Record> reaches{};    ///< is reached when this has run
  std::span<const std::byte> source{};  ///< pinned memory that it reads
  /// Poisoned when the operation becomes the next in its stream. Not earlier: those before it may read that.
  std::span<std::byte> result{};
};

}  // namespace substitute

struct CUstream_st {
  int device;
  bool nonBlocking = true;  ///< does not wait for the default stream, nor that for this
  bool destroyed = false;   ///< lives until its queue is empty
  std::deque<substitute::Operation> queue{};
};

struct CUevent_st {
  int device;
  bool timed;
  std::shared_ptr<substitute::Record> record{};  ///< the last
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
};
using Heap = std::map<const std::byte*, Memory>;  ///< by address

struct State {
  std::deque<Device> devices;  ///< at least deviceCount, so that what is on them can be freed
  int deviceCount = 1;
  cudaError_t deviceCountResult = cudaSuccess;
  std::size_t limit = std::size_t(1) << 32;  ///< of devices to come
  Heap deviceMemory, pinnedMemory;
  std::vector<std::unique_ptr<CUstream_st>> streams;
  std::vector<std::unique_ptr<CUevent_st>> events;
  std::size_t calls = 0, failingCall = 0;
  cudaError_t failure = cudaSuccess;
  std::size_t bytesToDevice = 0, freesThatWaited = 0;
  std::mt19937 random{1};  ///< what order of blocks and streams is tried
};

/// To be used within call(), release() and locked() only.
State& state();

/// Makes a call of the runtime: counts it, and fails it if a test asked for that. No two calls run at once.
/// Returns the Failure that the body throws, and keeps it as the thread's last error.
cudaError_t call(const std::function<void()>& body);
/// The same for calls that free something: the body is run even if the call is to fail.
cudaError_t release(const std::function<void()>& body);
/// What is not a call of the runtime, but must not run beside one.
void locked(const std::function<void()>& body);

/// What is each thread's own.
struct Caller {
  unsigned epoch = 0;  ///< of reset()
  int device = 0;
  cudaError_t lastError = cudaSuccess;
};
Caller& caller();

/// Throws Failure(cudaErrorIllegalAddress) if the device is lost.
void expectAlive(int device);
/// Throws Failure(cudaErrorInvalidDevice) if there is no such device, and expectAlive().
Device& deviceOf(int number);
/// The calling thread's device, as deviceOf().
Device& currentDevice();
/// Throws Failure(cudaErrorIllegalAddress) once after a fault.
void surfaceFault(int device);

/// The allocation that holds all of these bytes; null if there is none.
const Memory* allocationOf(const Heap& heap, const void* memory, std::size_t sizeBytes);
/// Throws Failure(cudaErrorInvalidValue) unless all of these bytes are of one allocation on the device.
void expectOnDevice(const void* memory, std::size_t sizeBytes, int device);

bool overlap(std::span<const std::byte> a, std::span<const std::byte> b);

/// Work on a default stream runs at once.
void enqueue(CUstream_st& stream, Operation operation);
/// Runs one operation: the stream's next, or one that this waits for. The queue must not be empty.
void step(CUstream_st& stream);
/// Runs all that is queued, and what it waits for.
void finish(CUstream_st& stream);
/// The same for all streams of a device, in turns. Whether anything was queued.
bool finishDevice(int device);
/// Runs what is queued for the copies that use this pinned memory. Whether there were any.
bool finishUsersOf(std::span<const std::byte> pinned);
/// What the default stream waits for: the streams that are not non-blocking.
void finishBlockingStreams(int device);
void reach(Record& record);

}  // namespace substitute
