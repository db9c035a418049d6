// SPDX-License-Identifier: Apache-2.0
#include "server/commands/render.h"

#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "protocol/scene_json.h"
#include "renderer/core/error.h"
#include "renderer/io/image_file.h"
#include "renderer/io/output_file.h"
#include "renderer/renderer.h"
#include "server/commands/interrupt.h"
#include "server/commands/render_device.h"
#include "server/commands/scene_arguments.h"
#include "server/commands/validators.h"
#include "server/scene_resolver.h"
#include "server/stop_rule.h"

namespace scolopax {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

struct RenderOptions {
  SceneArguments scene;
  std::filesystem::path out;
  std::optional<std::uint32_t> samples;
  std::optional<double> seconds, error;
  std::vector<std::string> aovs;
  std::filesystem::path stats;
  int threads = 0;
  std::string device = "auto";
};

/// An AOV to be written in addition to the picture.
struct AovFile {
  Aov aov;
  std::filesystem::path path;
};

/// "depth=depth.exr".
AovFile aovFileOf(const std::string& text) {
  const auto equals = text.find('=');
  const auto aov = aovOf(text.substr(0, equals));
  if (aov && equals != std::string::npos && equals + 1 < text.size()) return {*aov, text.substr(equals + 1)};
  throw CLI::ValidationError("--aov",
                             "expected NAME=FILE, NAME one of " + aovNames() + ", found '" + text + "'");
}

void writeAov(const AovFile& file, const Renderer& renderer) {
  const AovValues values = renderer.aov(file.aov);
  const bool isFloat = io::isFloatFormat(file.path);
  io::writeImage(file.path, isFloat ? aovImage(values) : aovPicture(values), glm::vec3(0));
}

/// A progress bar that is redrawn on one line of a terminal; elsewhere it prints nothing.
class ProgressBar {
 public:
  explicit ProgressBar(const server::StopRule& stop) : stop_(stop) {}
  void show(std::uint32_t samples, double seconds) {
    if (!terminal_ || seconds - shown_ < 0.1) return;
    shown_ = seconds;
    double done = stop_.samples > 0 ? double(samples) / stop_.samples : 0;
    if (stop_.seconds > 0) done = std::max(done, seconds / stop_.seconds);
    const int filled = int(std::min(done, 1.0) * kWidth);
    fmt::print(stderr, "\r[{:=<{}}{: <{}}] {} samples, {:.1f} s ", "", filled, "", kWidth - filled, samples,
               seconds);
    std::fflush(stderr);
  }
  void clear() const {
    if (terminal_ && shown_ > 0) fmt::print(stderr, "\r{: <{}}\r", "", kWidth + 40);
  }

 private:
  static constexpr int kWidth = 40;
  server::StopRule stop_;
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  double shown_ = 0;
};

void writeStats(const std::filesystem::path& path, const Renderer& renderer, const RebuildStats& rebuild,
                double seconds, const server::ResolvedScene& scene) {
  const RenderStats counts = renderer.stats();
  const double error = renderer.estimatedError();
  const Choice choice = renderer.choice();
  json corrections = json::array();
  for (const Choice::Correction& level : choice.corrections)
    corrections.push_back({{"step", level.step}, {"passes", level.passes}});
  const json stats = {{"samples", renderer.samples()},
                      {"seconds", seconds},
                      {"estimatedError", std::isfinite(error) ? json(error) : json(nullptr)},
                      {"rebuildMs", rebuild.rebuildMs},
                      {"backend", renderer.backendName()},
                      {"method", nameOf(choice.method)},
                      {"step", choice.step > 0 ? json(choice.step) : json(nullptr)},
                      {"corrections", corrections},
                      {"seed", scene.render.seed},
                      {"rays", counts.rays},
                      {"fetches", counts.fetches},
                      {"cellSteps", counts.cellSteps},
                      {"randomBlocks", counts.randomBlocks},
                      {"truncatedRays", counts.truncatedRays},
                      {"scene", protocol::toJson(scene.resolved)}};
  io::writeFile(path, stats.dump(2) + '\n');
}

void render(const RenderOptions& options) {
  // Checked first, so that no minutes are spent on a picture that cannot be written.
  io::checkImageName(options.out);
  io::checkWritable(options.out);
  if (!options.stats.empty()) io::checkWritable(options.stats);
  std::vector<AovFile> aovs;
  for (const std::string& text : options.aovs) {
    aovs.push_back(aovFileOf(text));
    io::checkImageName(aovs.back().path);
    io::checkWritable(aovs.back().path);
  }
  std::vector<std::filesystem::path> outputs{options.out};
  if (!options.stats.empty()) outputs.push_back(options.stats);
  for (const AovFile& aov : aovs) outputs.push_back(aov.path);
  checkOutputs(outputs, options.scene);
  const auto resolved = resolveScene(options.scene);
  server::StopRule stop = resolved->stop;
  // A stop rule on the command line replaces the scene's stop rule as a whole.
  if (options.samples || options.seconds || options.error)
    stop = {options.samples.value_or(0), options.seconds.value_or(0), options.error.value_or(0)};
  const Scene& scene = resolved->render;

  const auto renderer =
      rendererFactory(options.device, options.threads, nullptr, true, [](const std::string& line) {
        fmt::print(stderr, "scolopax: {}\n", line);
      }).make(resolved->dataset->load(resolved->time));
  if (!options.stats.empty()) renderer->countCosts();
  if (!aovs.empty()) renderer->recordAovs();
  const RebuildStats rebuild = renderer->setScene(scene);
  const std::atomic<bool>& cancel = catchInterrupts();
  ProgressBar bar(stop);
  const auto start = Clock::now();
  double seconds = 0;
  while (true) {
    // In slices, so that the bar moves and --seconds is met even if one sample takes long.
    renderer->renderSample(cancel, std::chrono::milliseconds(100));
    seconds = std::chrono::duration<double>(Clock::now() - start).count();
    bar.show(renderer->samples(), seconds);
    if (cancel) break;
    server::measureFor(stop, *renderer);
    if (server::stopMet(stop, *renderer, seconds)) break;
  }
  bar.clear();
  if (cancel) {
    fmt::print(
        stderr, "scolopax: interrupted after {} samples; {}\n", renderer->samples(),
        renderer->samples() > 0 ? "the picture is written with these samples" : "no picture is written");
    if (renderer->samples() == 0) endByInterrupt();
  }
  io::writeImage(options.out, renderer->image(), resolved->render.background);
  for (const AovFile& aov : aovs) writeAov(aov, *renderer);
  if (!options.stats.empty()) writeStats(options.stats, *renderer, rebuild, seconds, *resolved);
  if (cancel) endByInterrupt();
}

}  // namespace

CLI::App* addRenderCommand(CLI::App& root) {
  CLI::App* command = root.add_subcommand("render", "Render a scene into a picture file");
  const auto o = std::make_shared<RenderOptions>();
  addSceneArguments(*command, o->scene);
  command
      ->add_option("-o,--output", o->out,
                   "Picture: .png or .jpg (sRGB, over the background), .exr or .tif (float, linear "
                   "premultiplied RGBA)")
      ->required();
  command->add_option("--samples", o->samples, "Stop after this many samples per pixel")
      ->check(CLI::Range(1u, server::kMaxSamples));
  command->add_option("--seconds", o->seconds, "Stop after this time")->check(numberUpTo(1e9, false));
  command->add_option("--error", o->error, "Stop at this estimated RMSE over linear premultiplied RGBA")
      ->check(numberUpTo(1e9, false));
  checkDevice(command->add_option("--device", o->device, kDeviceDoc))->capture_default_str();
  command->add_option("--threads", o->threads, "Threads to use; 0: all")
      ->envname("SCOLOPAX_THREADS")
      ->check(CLI::Range(0, 1024));
  std::string names;
  for (const NamedValue& aov : kAovs) names += fmt::format("\n{}: {}", aov.name, aov.doc);
  command
      ->add_option("--aov", o->aovs,
                   "NAME=FILE: also write another quantity of the pixels, as values to .exr or .tif, as a "
                   "picture to .png or .jpg:" +
                       names)
      ->allow_extra_args(false);
  command->add_option("--stats", o->stats, "Write counts and times as JSON");
  command->footer(
      "Rendering stops at the first limit given here that is reached; without any, at those of the scene\n"
      "(default: 64 samples). Ctrl-C and SIGTERM stop it as well: the picture is written as it is, and the\n"
      "status is 130 or 143. A second signal ends the program at once.");
  // With this callback, CLI11 reads the environment only when this command is parsed, and not for every
  // command.
  command->parse_complete_callback([] {});
  command->callback([o] { render(*o); });
  return command;
}

}  // namespace scolopax
