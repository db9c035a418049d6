// SPDX-License-Identifier: Apache-2.0
// Options of a command from a configuration file; the command line and the environment take precedence.
#pragma once
#include <CLI/App.hpp>
#include <string>

namespace scolopax {

/// Sets every option of `command` that is not set yet from a file of lines `name = value` (TOML or INI; the
/// lines may stand in a section with the command's name). To be called from the command's callback. Throws
/// CLI::Error for a file that cannot be read, for a name that is not an option, and for a bad value.
void applyConfigFile(CLI::App& command, const std::string& file);

}  // namespace scolopax
