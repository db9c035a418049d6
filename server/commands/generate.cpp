// SPDX-License-Identifier: Apache-2.0
#include "server/commands/generate.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/generate/orbitals.h"
#include "renderer/io/loading.h"
#include "renderer/io/nrrd_write.h"
#include "renderer/io/output_file.h"

namespace scolopax {
namespace {

struct OrbitalOptions {
  std::string out;
  int size = 128;
  int channels = 4;
};

void generateOrbitalFile(const OrbitalOptions& options) {
  io::checkWritable(options.out);
  const auto size = std::uint64_t(options.size);
  const std::uint64_t bytes = size * size * size * 2 * std::uint64_t(options.channels);
  if (const std::uint64_t limit = io::defaultMemoryLimitBytes(); bytes > limit)
    throw Error(ErrorCode::tooLarge, "generate orbitals: " + std::to_string(bytes) +
                                         " bytes of voxels are more than half of this machine's memory (" +
                                         std::to_string(limit) + " bytes); choose a smaller --size");
  const GeneratedVolume volume = generateOrbitals(options.size, options.channels);
  io::writeNrrd(options.out, volume.grid, volume.channels);
}

}  // namespace

CLI::App* addGenerateCommand(CLI::App& root) {
  CLI::App* command = root.add_subcommand("generate", "Write a data set computed from a formula");
  command->require_subcommand(1);

  CLI::App* orbitals = command->add_subcommand(
      "orbitals", "Probability densities of hydrogen states as the channels of one NRRD volume (16 bit)");
  const auto options = std::make_shared<OrbitalOptions>();
  orbitals->add_option("OUT", options->out, "File to write, ending in .nrrd")->required();
  orbitals->add_option("--size", options->size, "Voxels along each edge of the cube")
      ->check(CLI::Range(2, 1024))
      ->capture_default_str();
  orbitals->add_option("--channels", options->channels, "Number of states, one per channel")
      ->check(CLI::Range(1, kMaxOrbitals))
      ->capture_default_str();
  orbitals->callback([options] { generateOrbitalFile(*options); });
  return command;
}

}  // namespace scolopax
