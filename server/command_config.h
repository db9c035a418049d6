// SPDX-License-Identifier: Apache-2.0
// Options of a command from a file, below what the command line and the environment say.
#pragma once
#include <CLI/App.hpp>
#include <string>

namespace scolopax {

/// Sets every option of `command` that nobody has set from a file of lines `name = value` (TOML or INI;
/// values may stand in a section of the command's name). To be called from the command's callback. Throws
/// CLI::Error for a file that cannot be read, a name that is no option, or a bad value.
void applyConfigFile(CLI::App& command, const std::string& file);

}  // namespace scolopax
