// SPDX-License-Identifier: Apache-2.0
#include "server/commands/render_device.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/cuda_launcher.h"
#include "renderer/core/error.h"
#include "renderer/cpu/instruction_set.h"
#include "renderer/launcher.h"

namespace scolopax {
namespace {

constexpr std::string_view kCudaPrefix = "cuda:";

/// N of "cuda:N".
std::optional<int> indexOf(const std::string& device) {
  if (!device.starts_with(kCudaPrefix)) return std::nullopt;
  int index = 0;
  const char *begin = device.data() + kCudaPrefix.size(), *end = device.data() + device.size();
  const auto [parsed, error] = std::from_chars(begin, end, index);
  return error == std::errc() && parsed == end && index >= 0 ? std::optional(index) : std::nullopt;
}

/// The CUDA devices that `device` names; empty if the CPU shall render.
std::vector<int> cudaDevices(const std::string& device) {
  if (device == "cpu") return {};
  std::string why;
  std::vector<int> found;
  for (const cuda::DeviceInfo& info : cuda::devices(&why)) found.push_back(info.index);
  if (device == "all" && !found.empty()) return found;
  if (device == "auto" || device == "cuda") found.resize(std::min<std::size_t>(found.size(), 1));
  if (device == "auto") return found;
  if (const std::optional<int> index = indexOf(device)) {
    if (std::find(found.begin(), found.end(), *index) != found.end()) return {*index};
    if (!found.empty()) throw Error(ErrorCode::device, fmt::format("--device: there is no {}", device));
  }
  if (found.empty()) throw Error(ErrorCode::device, fmt::format("--device {}: {}", device, why));
  return found;
}

}  // namespace

CLI::Option* checkDevice(CLI::Option* option) {
  return option->type_name("DEVICE")->check([](const std::string& device) {
    for (const char* name : {"auto", "cpu", "cuda", "all"})
      if (device == name) return std::string();
    return indexOf(device) ? std::string()
                           : fmt::format("expected auto, cpu, cuda, cuda:N or all, found {}", device);
  });
}

RendererFactory rendererFactory(const std::string& device, int threads, std::shared_ptr<MemoryBudget> memory,
                                bool continueOnCpu, std::function<void(const std::string&)> log) {
  const std::vector<int> indexes = cudaDevices(device);
  if (indexes.empty())
    return {"cpu", [threads, memory = std::move(memory)](std::shared_ptr<const Volume> volume) {
              return makeCpuRenderer(std::move(volume), threads, memory);
            }};
  const auto release = [memory] { return memory && memory->releaseSome(); };
  return {"cuda", [devices = cuda::openDevices(indexes, release), threads, memory = std::move(memory),
                   failure = cuda::DeviceFailure{continueOnCpu, std::move(log)}](
                      std::shared_ptr<const Volume> volume) {
            return makeRenderer(cuda::makeCudaLauncher(devices, threads, failure), std::move(volume), memory);
          }};
}

std::string describeDevices() {
  const char* sets[] = {"baseline instructions", "AVX2", "AVX-512"};
  std::string text = fmt::format("{:<8} {} threads, {}\n", "cpu", std::thread::hardware_concurrency(),
                                 sets[int(fastestInstructionSet())]);
  std::string why;
  const auto found = cuda::devices(&why);
  for (const cuda::DeviceInfo& info : found)
    text += fmt::format("{:<8} {}, compute capability {}.{}, {:.1f} GiB, {:.1f} GiB free\n",
                        fmt::format("cuda:{}", info.index), info.name, info.major, info.minor,
                        double(info.memoryBytes) / 0x1p30, double(info.freeBytes) / 0x1p30);
  if (found.empty()) text += fmt::format("{:<8} none: {}\n", "cuda", why);
  return text;
}

}  // namespace scolopax
