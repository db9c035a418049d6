// SPDX-License-Identifier: Apache-2.0
// Reads options of a command from a configuration file. The command line and the environment take precedence.
#pragma once
#include <CLI/App.hpp>
#include <string>

namespace scolopax {

/// Sets the options of `command` that are not set yet from a file of lines `name = value` (TOML or INI; the
/// lines may be in a section with the command's name). To be called from the command's callback. Throws
/// CLI::Error if the file cannot be read, a name is not an option, or a value is invalid.
void applyConfigFile(CLI::App& command, const std::string& file);

}  // namespace scolopax
