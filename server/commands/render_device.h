// SPDX-License-Identifier: Apache-2.0
// The option --device: what renders, the CPU or CUDA devices.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "renderer/renderer.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace scolopax {

/// What the documentation of --device says.
inline constexpr const char* kDeviceDoc =
    "What renders: cpu; cuda or cuda:N, one CUDA device; all, every CUDA device together; auto, the first "
    "CUDA device or, without one, the CPU";

/// Checks the values of an option --device; returns the option.
CLI::Option* checkDevice(CLI::Option* option);

/// Makes renderers that share the devices.
struct RendererFactory {
  std::string backend;  ///< "cpu" or "cuda"
  std::function<std::unique_ptr<Renderer>(std::shared_ptr<const Volume>)> make;
};
/// `threads`: of the CPU; 0 means all. Memory is charged to `memory`, if given. If a device fails and
/// `continueOnCpu` is set, rendering goes on on the CPU, and `log`, if given, receives a line. Throws
/// Error(device) if there is no such device.
RendererFactory rendererFactory(const std::string& device, int threads,
                                std::shared_ptr<MemoryBudget> memory = nullptr, bool continueOnCpu = true,
                                std::function<void(const std::string&)> log = nullptr);

/// One line for every device: its name for --device, and what it is.
std::string describeDevices();

}  // namespace scolopax
