// SPDX-License-Identifier: Apache-2.0
#include "server/commands/info.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/commands/render_device.h"
#include "server/dataset_store.h"

namespace scolopax {
namespace {

void printText(const server::Dataset& dataset) {
  const Grid& grid = dataset.volume->grid();
  const glm::dvec3 spacing = grid.spacing();
  fmt::print("{}: {} x {} x {} voxels, spacing {:g} x {:g} x {:g}, diagonal {:g}\n", dataset.id, grid.dims.x,
             grid.dims.y, grid.dims.z, spacing.x, spacing.y, spacing.z, grid.diagonal());
  int index = 0;
  for (const Channel& channel : dataset.volume->channels()) {
    const Histogram& h = channel.histogram;
    fmt::print("  {:2} {:<28} {:<4} {:g} .. {:g}{}{}", index++, channel.name, nameOf(channel.voxels.type()),
               h.minimum, h.maximum, channel.unit.empty() ? "" : " ", channel.unit);
    if (h.nonFiniteCount > 0) fmt::print(", {} voxels not finite", h.nonFiniteCount);
    fmt::print("\n");
  }
}

}  // namespace

CLI::App* addInfoCommand(CLI::App& root) {
  struct InfoOptions {
    std::vector<std::filesystem::path> paths;
    bool json = false, devices = false;
  };
  CLI::App* command = root.add_subcommand(
      "info",
      "Print the contents of volume files: dimensions, spacing, and each channel's name, type and range");
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("PATH", options->paths, "Volume files; files with the same grid form one data set");
  command->add_flag("--json", options->json,
                    "Print a JSON list with the answer of GET /api/v1/datasets/ID for each data set");
  command->add_flag("--devices", options->devices,
                    "Print the devices that can render, with their names for --device");
  command->callback([options] {
    if (options->devices) fmt::print("{}", describeDevices());
    if (options->paths.empty() && !options->devices)
      throw CLI::ValidationError("info", "expected at least one volume file, or --devices");
    if (options->paths.empty()) return;
    const auto warn = [](const std::string& line) { fmt::print(stderr, "scolopax: {}\n", line); };
    const auto datasets = io::loadDatasets(options->paths, io::defaultMemoryLimitBytes(), warn);
    if (options->json) {
      nlohmann::json list = nlohmann::json::array();
      for (const auto& dataset : datasets) list.push_back(server::describeJson(dataset));
      fmt::print("{}\n", list.dump(2));
      return;
    }
    for (const auto& dataset : datasets) printText(dataset);
  });
  return command;
}

}  // namespace scolopax
