// SPDX-License-Identifier: Apache-2.0
#include "server/commands/reference.h"

#include <fmt/core.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

#include "renderer/io/image_file.h"
#include "renderer/io/output_file.h"
#include "renderer/reference/render.h"
#include "server/commands/scene_arguments.h"
#include "server/commands/validators.h"

namespace scolopax {
namespace {

struct ReferenceArguments {
  SceneArguments scene;
  std::filesystem::path out;
  reference::ReferenceOptions options;
};

double rootMeanSquare(const std::vector<glm::vec4>& values) {
  double sum = 0;
  for (const glm::vec4& v : values) sum += glm::dot(glm::dvec4(v), glm::dvec4(v));
  return std::sqrt(sum / (4 * double(values.size())));
}

void renderTruth(const ReferenceArguments& arguments) {
  io::checkImageName(arguments.out);
  io::checkWritable(arguments.out);
  checkOutputs({arguments.out}, arguments.scene);
  const auto resolved = resolveScene(arguments.scene);
  reference::ReferenceOptions options = arguments.options;
  options.seed = resolved->render.seed;
  const auto truth =
      reference::renderReference(*resolved->dataset->load(resolved->time), resolved->render, options);
  io::writeImage(arguments.out, truth.image, resolved->render.background);
  fmt::print("largest error of a ray {:.2e}\nnoise of the picture {:.2e} (RMS)\n", truth.maximumRayError,
             rootMeanSquare(truth.standardError));
}

}  // namespace

CLI::App* addReferenceCommand(CLI::App& root) {
  CLI::App* command =
      root.add_subcommand("reference", "Render a scene in double precision: slow, the reference for errors");
  const auto o = std::make_shared<ReferenceArguments>();
  o->options.samplesPerAxis = 4;
  addSceneArguments(*command, o->scene);
  command
      ->add_option("-o,--output", o->out,
                   "Picture: .exr or .tif (float, linear premultiplied RGBA), .png or .jpg")
      ->required();
  command
      ->add_option(
          "--samples-per-axis", o->options.samplesPerAxis,
          "Strata per pixel along x and along y, with two rays in each; with image.filter=point one ray goes "
          "through the\npixel's centre, and there is no noise")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command
      ->add_option("--tolerance", o->options.tolerance,
                   "Error of a piece of a ray, as a share of the alpha that it adds. Less takes longer, most "
                   "with shadows.\n"
                   "Default: " +
                       fmt::format("{:g}, with shading or shadows {:g}", reference::Integrator::kTolerance,
                                   reference::Integrator::kToleranceLit))
      ->check(numberUpTo(0.1, false));
  command
      ->add_option(
          "--every", o->options.every,
          "Render only every so many pixels along x and along y, into a picture that much smaller; a "
          "divisor of\nwidth and height. Of 3, numbers 1, 4, 7, ... counted from 0")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command->footer(
      "Prints the largest estimated error of a ray, and the noise that remains from sampling the pixels' "
      "areas.\n"
      "The scene's integrator.method, .step and .macrocell have no effect.");
  command->callback([o] { renderTruth(*o); });
  return command;
}

}  // namespace scolopax
