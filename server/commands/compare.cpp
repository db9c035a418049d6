// SPDX-License-Identifier: Apache-2.0
#include "server/commands/compare.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "renderer/io/image_file.h"
#include "renderer/metrics/metrics.h"

namespace scolopax {
namespace {

struct CompareOptions {
  std::string a, b;
  bool json = false;
};

void compare(const CompareOptions& options) {
  const ImageDifference difference = compareImages(io::readImage(options.a), io::readImage(options.b));
  if (!options.json) {
    std::printf("rmse %.9g\npsnr %.9g dB\nmax  %.9g\n", difference.rmse, difference.psnr, difference.maximum);
    return;
  }
  // JSON has no infinity: the psnr of equal pictures is null.
  const auto number = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
  };
  const nlohmann::ordered_json out = {{"rmse", number(difference.rmse)},
                                      {"psnr", number(difference.psnr)},
                                      {"max", number(difference.maximum)}};
  std::printf("%s\n", out.dump().c_str());
}

}  // namespace

CLI::App* addCompareCommand(CLI::App& root) {
  CLI::App* command = root.add_subcommand(
      "compare", "Print RMSE, PSNR (dB, peak 1) and the largest difference of two pictures' linear RGB");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->a, "First picture (exr, tif, png, jpg)")->required();
  command->add_option("B", options->b, "Second picture, of the same size")->required();
  command->add_flag("--json", options->json,
                    "Print one JSON object {rmse, psnr, max}; psnr is null if equal");
  command->callback([options] { compare(*options); });
  return command;
}

}  // namespace scolopax
