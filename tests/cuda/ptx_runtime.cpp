// SPDX-License-Identifier: Apache-2.0
// Launches translated PTX: the functions that host code compiled by clang or nvcc calls to register and
// launch its kernels, and the memory that a thread may access.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "tests/cuda/ptx_machine.h"
#include "tests/cuda/substitute_runtime.h"

namespace {

// Functions instead of variables, because objects of other files register themselves before main.
std::map<std::string, const ptx::Kernel*>& kernels() {
  static std::map<std::string, const ptx::Kernel*> all;
  return all;
}
std::vector<ptx::Range>& tables() {
  static std::vector<ptx::Range> all;
  return all;
}
/// The name of the kernel behind a host function.
std::map<const void*, std::string>& hostFunctions() {
  static std::map<const void*, std::string> all;
  return all;
}

bool before(const ptx::Range& a, const ptx::Range& b) { return a.begin < b.begin; }

std::vector<ptx::Range> globalMemory(std::span<const substitute::Allocation> allocations) {
  std::vector<ptx::Range> ranges = tables();
  for (const substitute::Allocation& allocation : allocations) {
    const std::uint64_t begin = ptx::addressOf(allocation.begin);
    ranges.push_back({begin, begin + allocation.sizeBytes, allocation.onHost});
  }
  std::sort(ranges.begin(), ranges.end(), before);
  return ranges;
}

void runThreads(const ptx::Kernel& kernel, ptx::Thread thread, const std::byte* const* arguments) {
  for (thread.tid.z = 0; thread.tid.z < thread.ntid.z; ++thread.tid.z)
    for (thread.tid.y = 0; thread.tid.y < thread.ntid.y; ++thread.tid.y)
      for (thread.tid.x = 0; thread.tid.x < thread.ntid.x; ++thread.tid.x)
        kernel.run(thread, nullptr, arguments);
}

}  // namespace

namespace ptx {

Kernel::Kernel(const char* kernelName, Function function, std::vector<std::size_t> sizes, unsigned most)
    : name(kernelName), run(function), parameterSizes(std::move(sizes)), maxThreads(most) {
  kernels()[name] = this;
}

Table::Table(const void* values, std::size_t size) {
  tables().push_back({addressOf(values), addressOf(values) + size});
}

std::vector<std::string> kernelNames() {
  std::vector<std::string> names;
  for (const auto& [name, kernel] : kernels()) names.push_back(name);
  return names;
}

void checkAccess(const Thread& thread, std::uint64_t address, std::size_t size, Access access) {
  checkAlignment(address, size);
  const auto after = std::upper_bound(thread.global.begin(), thread.global.end(), Range{address, 0}, before);
  if (after != thread.global.begin() && std::prev(after)->holds(address, size)) {
    hostAccesses += std::prev(after)->onHost;
    return;
  }
  for (const Frame* frame = thread.local; frame; frame = frame->outer)
    if (frame->range.holds(address, size)) return;
  if (access == Access::load)
    for (const Range& range : thread.parameters)
      if (range.holds(address, size)) return;
  throw Fault(access == Access::load ? "load outside of memory" : "store outside of memory");
}

}  // namespace ptx

extern "C" {

cudaError_t cudaLaunchKernel(const void* function, dim3 grid, dim3 block, void** arguments, size_t,
                             cudaStream_t stream) {
  const auto name = hostFunctions().find(function);
  const auto known = name == hostFunctions().end() ? kernels().end() : kernels().find(name->second);
  if (known == kernels().end()) return substitute::launchKernel(stream, grid, block, 0, nullptr);
  const ptx::Kernel& kernel = *known->second;
  // The kernel runs later, with copies.
  std::vector<std::vector<std::byte>> copies;
  for (std::size_t i = 0; i < kernel.parameterSizes.size(); ++i) {
    const auto begin = static_cast<const std::byte*>(arguments[i]);
    copies.emplace_back(begin, begin + kernel.parameterSizes[i]);
  }
  return substitute::launchKernel(
      stream, grid, block, kernel.maxThreads,
      [&kernel, grid, block, copies = std::move(copies)](std::span<const substitute::Allocation> memory) {
        const std::vector<ptx::Range> global = globalMemory(memory);
        std::vector<const std::byte*> values;
        std::vector<ptx::Range> parameters;
        for (const std::vector<std::byte>& copy : copies) {
          values.push_back(copy.data());
          const std::uint64_t begin = ptx::addressOf(copy.data());
          parameters.push_back({begin, begin + copy.size()});
        }
        substitute::runBlocks(grid, [&](uint3 index) {
          ptx::Thread thread{{},
                             {block.x, block.y, block.z},
                             {index.x, index.y, index.z},
                             {grid.x, grid.y, grid.z},
                             global,
                             parameters};
          try {
            runThreads(kernel, thread, values.data());
          } catch (const ptx::Fault& fault) {
            substitute::reportFault(kernel.name + ": " + fault.what());
          }
        });
      });
}

// The functions that compilers call in host objects, by NVIDIA's binary interface. The module itself is not
// used: the translated kernels are found by name.
void** __cudaRegisterFatBinary(void*) {
  static void* handle = nullptr;
  return &handle;
}
void __cudaRegisterFatBinaryEnd(void**) {}
void __cudaUnregisterFatBinary(void**) {}
char __cudaInitModule(void**) { return 1; }
void __cudaRegisterFunction(void**, const char* hostFunction, char*, const char* kernelName, int, uint3*,
                            uint3*, dim3*, dim3*, int*) {
  hostFunctions()[hostFunction] = kernelName;
}

// For kernels that are called like functions. cuda/ never does that, but the symbol is referenced.
unsigned __cudaPushCallConfiguration(dim3, dim3, size_t, cudaStream_t) { std::abort(); }
cudaError_t __cudaPopCallConfiguration(dim3*, dim3*, size_t*, void*) { std::abort(); }
cudaError_t __cudaGetKernel(void**, const void*) { std::abort(); }
cudaError_t __cudaLaunchKernel(void*, dim3, dim3, void**, size_t, cudaStream_t) { std::abort(); }

}  // extern "C"
