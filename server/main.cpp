// SPDX-License-Identifier: Apache-2.0
// scolopax: the program. Each command is a file of commands/; this one maps failures to exit statuses.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "renderer/core/error.h"
#include "server/commands/compare.h"
#include "server/commands/generate.h"
#include "server/commands/info.h"
#include "server/commands/render.h"
#include "server/commands/serve.h"

namespace {

constexpr int kFailed = 1;    // what was asked for could not be done
constexpr int kBadUsage = 2;  // what was asked for is not clear

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Renders multi-channel volumes by multi-density Woodcock tracking, for the browser, scripts and files",
      "scolopax"};
  app.set_version_flag("--version", SCOLOPAX_VERSION);
  app.require_subcommand(1);
  app.footer("scolopax COMMAND --help tells more. Start with: scolopax generate orbitals orbitals.nrrd");
  scolopax::addServeCommand(app);
  scolopax::addRenderCommand(app);
  scolopax::addInfoCommand(app);
  scolopax::addGenerateCommand(app);
  scolopax::addCompareCommand(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scolopax: %s\n", error.what());
    return kFailed;
  }
}
