// SPDX-License-Identifier: Apache-2.0
// The option --device: whether the CPU or CUDA devices render.
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

/// The documentation of --device.
inline constexpr const char* kDeviceDoc =
    "Device that renders: cpu; cuda or cuda:N (one CUDA device); all (all CUDA devices together); auto (the "
    "first CUDA device or, if there is none, the CPU)";

/// Adds a check of the values of an option --device; returns the option.
CLI::Option* checkDevice(CLI::Option* option);

/// Makes renderers, which share the devices.
struct RendererFactory {
  std::string backend;  ///< "cpu" or "cuda"
  std::function<std::unique_ptr<Renderer>(std::shared_ptr<const Volume>)> make;
};
/// `threads`: number of CPU threads; 0 means all. Memory is charged to `memory`, if given. If a device fails
/// and `continueOnCpu` is set, rendering continues on the CPU, and `log`, if given, receives a line. Throws
/// Error(device) if there is no such device.
RendererFactory rendererFactory(const std::string& device, int threads,
                                std::shared_ptr<MemoryBudget> memory = nullptr, bool continueOnCpu = true,
                                std::function<void(const std::string&)> log = nullptr);

/// One line for every device: its name for --device, and its description.
std::string describeDevices();

}  // namespace scolopax
