// SPDX-License-Identifier: Apache-2.0
#include "server/commands/compare.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "renderer/io/image_file.h"
#include "renderer/io/output_file.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/metrics.h"

namespace scolopax {
namespace {

struct CompareOptions {
  std::string a, b, difference;
  bool json = false;
};

void compare(const CompareOptions& options) {
  if (!options.difference.empty()) {
    io::checkImageName(options.difference);
    io::checkWritable(options.difference);
  }
  const Image a = io::readImage(options.a), b = io::readImage(options.b);
  const ImageDifference difference = compareImages(a, b);
  const Flip flip = flipDifference(a, b);
  if (!options.difference.empty())
    io::writeImage(options.difference, flipPicture(flip, a.width, a.height), glm::vec3(0));
  if (!options.json) {
    std::printf("rmse %.9g\npsnr %.9g dB\nmax  %.9g\nrelative %.9g\nflip %.9g\n", difference.rmse,
                difference.psnr, difference.maximum, difference.relative, flip.mean);
    return;
  }
  // JSON has no infinity: the psnr of equal pictures is null.
  const auto number = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
  };
  const nlohmann::ordered_json out = {{"rmse", number(difference.rmse)},
                                      {"psnr", number(difference.psnr)},
                                      {"max", number(difference.maximum)},
                                      {"relative", number(difference.relative)},
                                      {"flip", number(flip.mean)}};
  std::printf("%s\n", out.dump().c_str());
}

}  // namespace

CLI::App* addCompareCommand(CLI::App& root) {
  CLI::App* command = root.add_subcommand(
      "compare",
      "Print RMSE, PSNR (dB, peak 1), the largest difference and the mean squared relative error of two "
      "pictures' linear premultiplied RGBA, and their mean FLIP");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->a, "First picture (exr, tif, png, jpg)")->required();
  command->add_option("B", options->b, "Second picture, of the same size; the relative error's reference")
      ->required();
  command->add_flag("--json", options->json,
                    "Print one JSON object {rmse, psnr, max, relative, flip}; psnr is null if equal");
  command->add_option("--difference", options->difference,
                      "Write the FLIP of every pixel as a picture, from black (0) to light yellow (1)");
  command->callback([options] { compare(*options); });
  return command;
}

}  // namespace scolopax
