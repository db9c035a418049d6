// SPDX-License-Identifier: Apache-2.0
// Speed and accuracy are meaningful only together, so every method gives a list of points (time, error). All
// are measured in turns, in one run, against the double-precision reference.
#include "server/commands/bench.h"

#include <fmt/core.h>
#include <malloc.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "protocol/scene_json.h"
#include "renderer/core/error.h"
#include "renderer/cpu/instruction_set.h"
#include "renderer/data/scene_checks.h"
#include "renderer/data/shared_macrocells.h"
#include "renderer/io/image_file.h"
#include "renderer/io/output_file.h"
#include "renderer/reference/render.h"
#include "server/commands/bench_measure.h"
#include "server/commands/bench_points.h"
#include "server/commands/render_device.h"
#include "server/commands/scene_arguments.h"
#include "server/commands/validators.h"
#include "server/stop_rule.h"

namespace scolopax {
namespace {

using bench::Point;
using bench::Renderers;
using bench::Setting;
using nlohmann::ordered_json;

struct BenchOptions {
  SceneArguments scene;
  std::vector<std::string> methods;
  std::vector<std::uint32_t> samples{1, 4, 16, 64};
  std::vector<double> steps{4, 2, 1, 0.5, 0};
  std::vector<int> macrocells;  // none: the scene's
  std::vector<int> threads{0};
  std::string device = "cpu";
  int repetitions = 3;
  double longest = 10;
  std::optional<double> automaticLongest, until;
  std::filesystem::path truth, json;
  bool timesOnly = false, sceneFilter = false;
};

/// In ascending order, without duplicates.
template <class Number>
std::vector<Number> ordered(std::vector<Number> numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

/// All requested settings, without numbers of samples. Those of one method are adjacent.
std::vector<Setting> settingsOf(const BenchOptions& options) {
  std::vector<Setting> settings;
  for (std::size_t i = 0; i < std::size(kMethods); ++i) {
    const auto method = Method(i);
    const bool named =
        std::find(options.methods.begin(), options.methods.end(), nameOf(method)) != options.methods.end();
    // `auto` chooses one of the other methods, so it is measured only on request.
    if (options.methods.empty() ? method == Method::automatic : !named) continue;
    for (const int macrocell : ordered(options.macrocells))
      for (const int threads : ordered(options.threads))
        for (const double step : hasStep(method) ? ordered(options.steps) : std::vector<double>{0})
          settings.push_back({method, 1, step, macrocell, threads});
  }
  return settings;
}

Renderers renderersFor(const std::shared_ptr<const Volume>& volume, const BenchOptions& options) {
  Renderers renderers;
  for (const int threads : options.threads)
    renderers[threads] = rendererFactory(options.device, threads).make(volume);
  return renderers;
}

/// Bytes allocated in the whole program.
std::size_t heapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// Bytes of the data and of the structures made from it, measured by the growth of the heap.
ordered_json memoryOf(const std::shared_ptr<const Volume>& volume, Scene scene, int macrocell) {
  std::size_t data = 0;
  for (const Channel& channel : volume->channels())
    data += channel.voxels.count() * sizeBytes(channel.voxels.type());
  const auto grown = [](std::size_t from, std::size_t to) { return to > from ? to - from : 0; };
  const auto renderer = makeCpuRenderer(volume, 0);
  const glm::ivec2 size(scene.width, scene.height);
  scene.macrocell = macrocell;
  scene.width = scene.height = 1;
  const std::size_t before = heapBytes();
  const auto cells = sharedMacrocells(volume, macrocell);
  const std::size_t withCells = heapBytes();
  renderer->setScene(scene);
  const std::size_t withMajorants = heapBytes();
  scene.width = size.x;
  scene.height = size.y;
  renderer->setScene(scene);
  return {{"macrocell", macrocell},
          {"voxels", volume->grid().voxelCount()},
          {"channels", volume->channels().size()},
          {"pixels", size.x * size.y},
          {"data", data},
          {"macrocells", grown(before, withCells)},
          {"majorants", grown(withCells, withMajorants)},
          {"film", grown(withMajorants, heapBytes())}};
}

std::optional<Image> truthOf(const BenchOptions& options, const Volume& volume, const Scene& scene) {
  if (options.timesOnly) return std::nullopt;
  if (options.truth.empty()) {
    fmt::print(stderr, "scolopax: rendering the reference\n");
    return reference::renderReference(volume, scene, 1).image;
  }
  Image truth = io::readImage(options.truth);
  const int factor = options.sceneFilter ? 1 : scene.width / std::max(truth.width, 1);
  if (factor % 2 == 0 || truth.width * factor != scene.width || truth.height * factor != scene.height)
    throw Error(ErrorCode::badInput,
                fmt::format("{}: expected {}x{} pixels{}, found {}x{}", options.truth.string(), scene.width,
                            scene.height, options.sceneFilter ? "" : ", or fewer by an odd factor",
                            truth.width, truth.height));
  return truth;
}

void run(BenchOptions options) {
  for (const std::string& method : options.methods)
    if (std::none_of(std::begin(kMethods), std::end(kMethods),
                     [&](const NamedValue& known) { return known.name == method; }))
      throw CLI::ValidationError("--methods", "there is no method '" + method + "'");
  if (!options.json.empty()) {
    io::checkWritable(options.json);
    checkOutputs({options.json}, options.scene);
  }
  const auto resolved = resolveScene(options.scene);
  const auto volume = resolved->dataset->load(resolved->time);
  Scene scene = resolved->render;
  if (!options.sceneFilter) scene.filter = PixelFilter::point;  // there the reference has no noise
  if (options.macrocells.empty()) options.macrocells = {scene.macrocell};
  const std::optional<Image> truth = truthOf(options, *volume, scene);

  ordered_json memory = ordered_json::array();
  for (const int macrocell : ordered(options.macrocells))
    memory.push_back(memoryOf(volume, scene, macrocell));
  std::vector<std::shared_ptr<const MacrocellGrid>> held;  // so that macrocells are not rebuilt
  for (const int macrocell : options.macrocells) held.push_back(sharedMacrocells(volume, macrocell));
  const Renderers renderers = renderersFor(volume, options), counting = renderersFor(volume, options);
  for (const auto& [threads, renderer] : counting) renderer->countCosts();
  const std::vector<Point> points =
      bench::measure({settingsOf(options), ordered(options.samples), options.repetitions, options.longest,
                      options.automaticLongest.value_or(options.longest), options.until},
                     renderers, counting, scene, truth);

  ordered_json result = bench::report(points, truth, std::size_t(scene.width) * std::size_t(scene.height));
  result["memory"] = memory;
  result["scene"] = ordered_json::parse(protocol::toJson(resolved->resolved).dump());
  result["picked"] = nameOf(resolved->render.method);
  result["repetitions"] = options.repetitions;
  result["instructions"] = nameOf(fastestInstructionSet());
  if (options.json.empty())
    bench::print(result);
  else
    io::writeFile(options.json, result.dump(1) + '\n');
}

/// What is measured.
void addSettings(CLI::App& command, BenchOptions& o) {
  command
      .add_option("--methods", o.methods, "Methods to measure, separated by commas; default: all but auto")
      ->delimiter(',');
  command.add_option("--samples", o.samples, "Sample counts; default: 1,4,16,64")
      ->delimiter(',')
      ->check(CLI::Range(1u, server::kMaxSamples));
  command
      .add_option("--steps", o.steps, "Steps of the methods that have one, in voxels; default: 4,2,1,0.5,0")
      ->delimiter(',')
      ->check(numberUpTo(100, true));
  command.add_option("--macrocells", o.macrocells, "Macrocell edges, in voxels; default: the scene's")
      ->delimiter(',')
      ->check(CLI::Range(1, kMaxMacrocell));
  checkDevice(command.add_option("--device", o.device, kDeviceDoc))->capture_default_str();
  command.add_option("--threads", o.threads, "Numbers of threads; 0: all")
      ->delimiter(',')
      ->check(CLI::Range(0, 1024));
}

/// How long, and against what.
void addLimitsAndTruth(CLI::App& command, BenchOptions& o) {
  command
      .add_option(
          "--repetitions", o.repetitions,
          fmt::format("Repetitions of every point, each with its own seed, 2 of those that take longer "
                      "than {:g} s; medians are reported",
                      bench::kLongPicture))
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  command
      .add_option("--longest", o.longest,
                  "Skip sample counts that would take more seconds than this, except the smallest")
      ->check(numberUpTo(1e9, false))
      ->capture_default_str();
  command
      .add_option("--auto-longest", o.automaticLongest,
                  "The same for auto, whose time to an error is measured and not extrapolated; default: "
                  "--longest")
      ->check(numberUpTo(1e9, false));
  auto* until = command
                    .add_option("--until", o.until,
                                "Double the samples until the RMSE is at most this, or more samples cannot "
                                "help, or one of the limits above is reached")
                    ->check(numberUpTo(1e9, false));
  auto* truth =
      command.add_option("--truth", o.truth,
                         "Reference picture for the errors, made by scolopax reference with "
                         "image.filter=point. It may be smaller by an odd factor;\nthen only the pixels at "
                         "the centres of its pixels count. By default, the reference is rendered");
  command
      .add_flag(
          "--scene-filter", o.sceneFilter,
          "Spread samples over pixels as the scene says. --truth must be a picture of the same kind and "
          "size, with much less noise,\nwhich adds to the errors")
      ->needs(truth);
  command.add_flag("--times-only", o.timesOnly, "Times and counts only, no reference and no errors")
      ->excludes(truth)
      ->excludes(until);
}

}  // namespace

CLI::App* addBenchCommand(CLI::App& root) {
  CLI::App* command =
      root.add_subcommand("bench", "Measure speed against error of the methods on one scene, in one run");
  const auto o = std::make_shared<BenchOptions>();
  addSceneArguments(*command, o->scene);
  addSettings(*command, *o);
  addLimitsAndTruth(*command, *o);
  command->add_option("--json", o->json, "Write the numbers to this file instead of printing a table");
  command->footer(
      "Samples go through the pixels' centres, where the reference has no noise, unless --scene-filter is\n"
      "given. Methods without a step are unbiased; their 1 / (MSE x seconds) is compared with that of "
      "sync-dda\n"
      "at the same number of samples (to sync). The bias is the error that remains when the pictures of all\n"
      "repetitions are averaged. setScene is the time before the first sample, in which auto chooses; times "
      "to\n"
      "an error include it. Fetches, cells and randoms are per ray, and include those of auto's "
      "corrections.");
  command->callback([o] { run(*o); });
  return command;
}

}  // namespace scolopax
