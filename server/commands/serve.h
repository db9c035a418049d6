// SPDX-License-Identifier: Apache-2.0
// `scolopax serve`: the program's main command.
#pragma once
#include <CLI/App.hpp>

namespace scolopax {

/// Adds `serve`. Its callback serves until SIGTERM or SIGINT. It throws scolopax::Error, or CLI::Error for
/// bad usage.
CLI::App* addServeCommand(CLI::App& root);

}  // namespace scolopax
