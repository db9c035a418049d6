// SPDX-License-Identifier: Apache-2.0
#include "server/command_config.h"

#include <CLI/CLI.hpp>

namespace scolopax {

// CLI11's own set_config gives the file precedence over the environment.
void applyConfigFile(CLI::App& command, const std::string& file) {
  for (const CLI::ConfigItem& item : CLI::ConfigTOML().from_file(file)) {
    if (item.name == "++" || item.name == "--") continue;  // begin and end of a section
    const bool ours = item.parents.empty() || item.parents == std::vector<std::string>{command.get_name()};
    CLI::Option* option = ours ? command.get_option_no_throw("--" + item.name) : nullptr;
    if (option == nullptr)
      throw CLI::ConfigError(file + ": " + item.fullname() + " is not an option of " + command.get_name());
    if (option->count() > 0) continue;
    option->add_result(item.inputs);
    option->run_callback();
  }
}

}  // namespace scolopax
