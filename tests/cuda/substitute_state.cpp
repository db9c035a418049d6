// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/substitute_state.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <utility>

namespace substitute {
namespace {

std::mutex mutex;  // of the state
std::atomic<unsigned> epoch = 0;

// A separate mutex, because kernels report faults from several threads while the call that runs them holds
// the other one.
struct Faults {
  std::mutex mutex;
  std::string last;
  std::set<int> pending;  // devices
  int running = -1;       // the device of the operation that is running
};
Faults& faults() {
  static Faults all;
  return all;
}

State initialState() {
  State initial;
  initial.devices.emplace_back(0, initial.limit);
  return initial;
}

void setRunning(int device) {
  const std::lock_guard lock(faults().mutex);
  faults().running = device;
}

Leaks countLeaks() {
  const State& now = state();
  const auto streams = std::count_if(now.streams.begin(), now.streams.end(),
                                     [](const auto& stream) { return !stream->destroyed; });
  return {now.deviceMemory.size(), now.pinnedMemory.size(), std::size_t(streams), now.events.size()};
}

/// Counts a call; returns whether it must fail.
bool isToFail() { return ++state().calls == state().failingCall; }

cudaError_t returned(cudaError_t error) {
  if (error != cudaSuccess) caller().lastError = error;
  return error;
}

cudaError_t errorOf(const std::function<void()>& body) {
  try {
    body();
  } catch (const Failure& failure) {
    return failure.error;
  }
  return cudaSuccess;
}

/// Poisons the memory that the next operation will write.
void poisonNextResult(const CUstream_st& stream) {
  if (!stream.queue.empty()) std::ranges::fill(stream.queue.front().result, kPoison);
}

}  // namespace

State& state() {
  static State now = initialState();
  return now;
}

Caller& caller() {
  thread_local Caller own;
  if (own.epoch != epoch) own = {epoch};
  return own;
}

cudaError_t call(const std::function<void()>& body) {
  const std::lock_guard lock(mutex);
  return returned(isToFail() ? state().failure : errorOf(body));
}

cudaError_t release(const std::function<void()>& body) {
  const std::lock_guard lock(mutex);
  const bool fails = isToFail();
  const cudaError_t error = errorOf(body);
  return returned(fails ? state().failure : error);
}

void locked(const std::function<void()>& body) {
  const std::lock_guard lock(mutex);
  body();
}

void expectAlive(int device) {
  if (state().devices[std::size_t(device)].lost) throw Failure{cudaErrorIllegalAddress};
}

Device& deviceOf(int number) {
  const int count = state().deviceCount;
  if (number < 0 || number >= count) throw Failure{count == 0 ? cudaErrorNoDevice : cudaErrorInvalidDevice};
  expectAlive(number);
  return state().devices[std::size_t(number)];
}

Device& currentDevice() { return deviceOf(caller().device); }

void surfaceFault(int device) {
  const std::lock_guard lock(faults().mutex);
  if (faults().pending.erase(device) > 0) throw Failure{cudaErrorIllegalAddress};
}

const Memory* allocationOf(const Heap& heap, const void* memory, std::size_t sizeBytes) {
  const auto begin = static_cast<const std::byte*>(memory);
  auto found = heap.upper_bound(begin);
  if (found == heap.begin()) return nullptr;
  --found;
  const std::size_t offset = std::size_t(begin - found->first), size = found->second.sizeBytes;
  return offset <= size && sizeBytes <= size - offset ? &found->second : nullptr;
}

void expectOnDevice(const void* memory, std::size_t sizeBytes, int device) {
  const Memory* found = allocationOf(state().deviceMemory, memory, sizeBytes);
  if (!found || found->device != device) throw Failure{cudaErrorInvalidValue};
}

bool overlap(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto before = [](const std::byte* one, const std::byte* other) { return std::less<>()(one, other); };
  return before(a.data(), b.data() + b.size()) && before(b.data(), a.data() + a.size());
}

void enqueue(CUstream_st& stream, Operation operation) {
  stream.queue.push_back(std::move(operation));
  if (stream.queue.size() == 1) poisonNextResult(stream);
  if (&stream != &state().devices[std::size_t(stream.device)].defaultStream) return;
  finishBlockingStreams(stream.device);
  finish(stream);
}

void step(CUstream_st& stream) {
  const auto& after = stream.queue.front().after;
  if (after && !after->reached) return step(*after->stream);
  const Operation operation = std::move(stream.queue.front());
  stream.queue.pop_front();
  setRunning(stream.device);
  if (operation.run) operation.run();
  setRunning(-1);
  if (operation.reaches) reach(*operation.reaches);
  poisonNextResult(stream);
}

void finish(CUstream_st& stream) {
  while (!stream.queue.empty()) step(stream);
}

bool finishDevice(int device) {
  for (bool any = false;; any = true) {
    std::vector<CUstream_st*> busy;
    for (const auto& stream : state().streams)
      if (stream->device == device && !stream->queue.empty()) busy.push_back(stream.get());
    if (busy.empty()) return any;
    step(*busy[state().random() % busy.size()]);
  }
}

bool finishUsersOf(std::span<const std::byte> pinned) {
  bool any = false;
  for (const auto& stream : state().streams) {
    const bool uses = std::ranges::any_of(stream->queue, [&](const Operation& operation) {
      return overlap(operation.source, pinned) || overlap(operation.result, pinned);
    });
    if (uses) finish(*stream);
    any |= uses;
  }
  return any;
}

void finishBlockingStreams(int device) {
  for (const auto& stream : state().streams)
    if (stream->device == device && !stream->nonBlocking) finish(*stream);
}

void reach(Record& record) {
  record.reached = true;
  record.time = std::chrono::steady_clock::now();
}

bool reset() {
  const std::lock_guard lock(mutex);
  if (countLeaks() != Leaks()) return false;
  state() = initialState();
  ++epoch;
  const std::lock_guard lockOfFaults(faults().mutex);
  faults().last.clear();
  faults().pending.clear();
  return true;
}

void setDeviceCount(cudaError_t result, int count) {
  locked([&] {
    State& now = state();
    now.deviceCountResult = result;
    now.deviceCount = count;
    while (int(now.devices.size()) < count) now.devices.emplace_back(int(now.devices.size()), now.limit);
  });
}

void limitMemory(std::size_t sizeBytes) {
  locked([&] {
    state().limit = sizeBytes;
    for (Device& device : state().devices) device.limit = sizeBytes;
  });
}

void limitMemory(int device, std::size_t sizeBytes) {
  locked([&] { state().devices.at(std::size_t(device)).limit = sizeBytes; });
}

std::vector<Allocation> usableByKernels() {
  std::vector<Allocation> all;
  for (const auto& [begin, memory] : state().deviceMemory)
    all.push_back({begin, memory.sizeBytes, memory.device});
  for (const auto& [begin, memory] : state().pinnedMemory)
    if (memory.mapped) all.push_back({begin, memory.sizeBytes, memory.device, true});
  return all;
}

std::vector<Allocation> allocations() {
  std::vector<Allocation> all;
  locked([&] { all = usableByKernels(); });
  std::erase_if(all, [](const Allocation& allocation) { return allocation.onHost; });
  return all;
}

std::vector<Allocation> mappedAllocations() {
  std::vector<Allocation> all;
  locked([&] { all = usableByKernels(); });
  std::erase_if(all, [](const Allocation& allocation) { return !allocation.onHost; });
  return all;
}

Leaks leaks() {
  Leaks found;
  locked([&] { found = countLeaks(); });
  return found;
}

std::size_t bytesToDevice() {
  std::size_t bytes = 0;
  locked([&] { bytes = state().bytesToDevice; });
  return bytes;
}

std::size_t freesThatWaited() {
  std::size_t count = 0;
  locked([&] { count = state().freesThatWaited; });
  return count;
}

std::size_t callCount() {
  std::size_t count = 0;
  locked([&] { count = state().calls; });
  return count;
}

void failCall(std::size_t n, cudaError_t error) {
  locked([&] {
    state().failingCall = n == 0 ? 0 : state().calls + n;
    state().failure = error;
  });
}

void loseDevice(int device) {
  locked([&] {
    state().devices.at(std::size_t(device)).lost = true;
    for (const auto& stream : state().streams) {
      if (stream->device != device) continue;
      for (const Operation& operation : std::exchange(stream->queue, {}))
        if (operation.reaches) reach(*operation.reaches);
    }
  });
}

void reportFault(const std::string& what) {
  const std::lock_guard lock(faults().mutex);
  faults().last = what;
  faults().pending.insert(faults().running >= 0 ? faults().running : caller().device);
}

std::string lastFault() {
  const std::lock_guard lock(faults().mutex);
  return faults().last;
}

}  // namespace substitute
