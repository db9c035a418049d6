// SPDX-License-Identifier: Apache-2.0
// `scolopax serve`: the program's main command.
#pragma once
#include <CLI/App.hpp>

namespace scolopax {

/// Adds the subcommand; its callback serves until SIGTERM or SIGINT and throws scolopax::Error, or CLI::Error
/// for bad usage.
CLI::App* addServeCommand(CLI::App& root);

}  // namespace scolopax
