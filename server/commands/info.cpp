// SPDX-License-Identifier: Apache-2.0
#include "server/commands/info.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/commands/data_options.h"
#include "server/commands/load_bar.h"
#include "server/commands/render_device.h"
#include "server/dataset_store.h"
#include "server/hex_color.h"

namespace scolopax {
namespace {

std::string sizeOf(const glm::ivec3& dims) { return fmt::format("{} x {} x {}", dims.x, dims.y, dims.z); }

/// What the headers say of a data set, without its channels.
void printHeader(const io::Dataset& dataset) {
  const Grid& grid = dataset.levels[0];
  const glm::dvec3 spacing = grid.spacing();
  const std::string unit = dataset.worldUnit.empty() ? "" : " " + dataset.worldUnit;
  fmt::print("{}: {} voxels, spacing {:g} x {:g} x {:g}{}, diagonal {:g}{}\n", dataset.id, sizeOf(grid.dims),
             spacing.x, spacing.y, spacing.z, unit, grid.diagonal(), unit);
  std::string volumes;
  for (const auto& [file, part] : dataset.sources)
    if (const std::string& path = file->volumes[part.volume].path; !path.empty())
      volumes += (volumes.empty() ? "" : ", ") + path;
  if (!volumes.empty()) fmt::print("  volumes in the file: {}\n", volumes);
  if (dataset.levels.size() > 1) {
    fmt::print("  {} levels of resolution:", dataset.levels.size());
    for (const Grid& level : dataset.levels)
      fmt::print(" {}{}", &level == &dataset.levels[0] ? "" : "> ", sizeOf(level.dims));
    fmt::print("\n");
  }
  if (const io::Times& times = dataset.times; times.count > 1) {
    fmt::print("  {} times", times.count);
    if (!times.values.empty())
      fmt::print(": {:g} .. {:g}{}{}", times.values.front(), times.values.back(),
                 times.unit.empty() ? "" : " ", times.unit);
    fmt::print("\n");
  }
}

/// Begins a channel's line.
void printChannel(int index, const std::string& name, std::string_view type) {
  fmt::print("  {:2} {:<28} {:<7}", index, name, type);
}

/// Ends the line with what the file says of the channel's look.
void printLook(const StatedLook& look) {
  if (look.color) fmt::print(", {}", server::hexOf(*look.color));
  if (look.window) fmt::print(", window {:g} .. {:g}", look.window->lo, look.window->hi);
  if (look.labels) fmt::print(", labels");
  fmt::print("\n");
}

void printHeaders(const io::Dataset& dataset) {
  printHeader(dataset);
  int index = 0;
  for (const io::ChannelInfo& channel : dataset.channels) {
    printChannel(index++, channel.name, io::nameOf(channel.type));
    fmt::print("{}{}", channel.unit.empty() ? "" : " ", channel.unit);
    printLook(channel.look);
  }
  fmt::print("  needs at most {} of memory\n", io::byteCount(io::memoryBytes(dataset)));
}

void printLoaded(const io::Dataset& dataset, const io::LoadedDataset& loaded) {
  printHeader(dataset);
  int index = 0;
  for (const Channel& channel : loaded.volume->channels()) {
    const Histogram& h = channel.histogram;
    printChannel(index++, channel.name, nameOf(channel.type));
    fmt::print(" {:g} .. {:g}{}{}", h.minimum, h.maximum, channel.unit.empty() ? "" : " ", channel.unit);
    if (h.nonFiniteCount > 0) fmt::print(", {} voxels not finite", h.nonFiniteCount);
    printLook(channel.look);
  }
}

struct InfoOptions {
  std::vector<std::filesystem::path> paths;
  DataOptions data;
  bool json = false, devices = false, headers = false;
};

void printDatasets(const InfoOptions& options) {
  const auto warn = [](const std::string& line) { fmt::print(stderr, "scolopax: {}\n", line); };
  const auto opened = io::openDatasets(options.paths, openOptionsOf(options.data, warn));
  std::vector<io::LoadedDataset> loaded;
  if (!options.headers) {
    LoadBar bar;
    const auto show = [&bar](const io::Progress& now) { bar.show(now.stage, now.doneBytes, now.allBytes); };
    loaded = io::loadDatasets(opened, 0, {.warn = warn, .progress = show});
  }
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < opened.size(); ++i) {
    if (options.json)
      list.push_back(options.headers ? server::describeJson(opened[i])
                                     : server::describeJson(server::Dataset(std::move(loaded[i]))));
    else if (options.headers)
      printHeaders(opened[i]);
    else
      printLoaded(opened[i], loaded[i]);
  }
  if (options.json) fmt::print("{}\n", list.dump(2));
}

}  // namespace

CLI::App* addInfoCommand(CLI::App& root) {
  CLI::App* command = root.add_subcommand("info",
                                          "Print the contents of volume files: dimensions, spacing, levels, "
                                          "times, and each channel's name, type and range");
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("PATH", options->paths, kDataDoc);
  addDataOptions(*command, options->data);
  command->add_flag(
      "--headers", options->headers,
      "Read the headers only, which is quick: types as in the files, and no ranges, for which all voxels "
      "must be read");
  command->add_flag(
      "--json", options->json,
      "Print a JSON list with the answer of GET /api/v1/datasets/ID for each data set, or with --headers "
      "what the headers say of it");
  command->add_flag("--devices", options->devices,
                    "Print the devices that can render, with their names for --device");
  command->callback([options] {
    if (options->devices) fmt::print("{}", describeDevices());
    if (options->paths.empty() && !options->devices)
      throw CLI::ValidationError("info", "expected at least one volume file, or --devices");
    if (options->paths.empty()) return;
    printDatasets(*options);
  });
  return command;
}

}  // namespace scolopax
