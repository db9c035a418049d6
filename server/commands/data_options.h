// SPDX-License-Identifier: Apache-2.0
// Options for opening volume files, the same in several commands.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "renderer/io/volume_file.h"

namespace scolopax {

inline constexpr const char* kDataDoc =
    "Volume files or folders; FILE:NAME is one data set or channel of a file. Those with the same grid form "
    "one data set";

struct DataOptions {
  std::string fourthAxis = "auto";
  std::vector<std::string> allowedHosts = {};
};

/// Adds the options that set `options`, which must live as long as the command. `added` is called for each,
/// if given.
void addDataOptions(CLI::App& command, DataOptions& options,
                    const std::function<void(CLI::Option&)>& added = {});
io::OpenOptions openOptionsOf(const DataOptions& options, io::Warn warn);

}  // namespace scolopax
