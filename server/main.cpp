// SPDX-License-Identifier: Apache-2.0
// The program scolopax. Each command is a file in commands/; this file maps failures to exit statuses.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "renderer/core/error.h"
#include "server/commands/bench.h"
#include "server/commands/compare.h"
#include "server/commands/generate.h"
#include "server/commands/info.h"
#include "server/commands/reference.h"
#include "server/commands/render.h"
#include "server/commands/serve.h"

namespace {

constexpr int kFailed = 1;    // the command failed
constexpr int kBadUsage = 2;  // the command line is invalid

/// The word in the place of a command; empty if the error is a different one.
std::string unknownCommand(const CLI::App& app) {
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) last = last->get_subcommands().front();
  const auto words = last->remaining();
  return last->get_require_subcommand_min() == 0 || words.empty() ? "" : words.front();
}

/// The environment variable that has the invalid value; empty if the value has another origin.
std::string variableAtFault(const CLI::App& app, const std::string& message) {
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      const char* value = std::getenv(option->get_envname().c_str());
      if (value != nullptr && option->results() == std::vector<std::string>{value} &&
          (message.find(option->get_name() + ": ") != std::string::npos ||
           message.find(option->get_name() + " = ") != std::string::npos))
        return option->get_envname();
    }
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Renders multi-channel volumes by multi-density Woodcock tracking, for the browser, scripts and files",
      "scolopax"};
  app.set_version_flag("--version", SCOLOPAX_VERSION);
  app.require_subcommand(1);
  app.footer("Run scolopax COMMAND --help for details. Start with: scolopax generate orbitals orbitals.nrrd");
  scolopax::addServeCommand(app);
  scolopax::addRenderCommand(app);
  scolopax::addInfoCommand(app);
  scolopax::addGenerateCommand(app);
  scolopax::addCompareCommand(app);
  scolopax::addBenchCommand(app);
  scolopax::addReferenceCommand(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    if (const std::string word = unknownCommand(app); error.get_exit_code() != 0 && !word.empty()) {
      std::fprintf(stderr,
                   "scolopax: %s is not a command or an option\nRun with --help for more information.\n",
                   word.c_str());
      return kBadUsage;
    }
    const std::string variable = variableAtFault(app, error.what());
    if (!variable.empty()) std::fprintf(stderr, "%s: ", variable.c_str());
    return app.exit(error) == 0 ? 0 : kBadUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scolopax: %s\n", error.what());
    return kFailed;
  }
}
