// SPDX-License-Identifier: Apache-2.0
// Compares this renderer with the methods of Knoll et al. 2009 (peaks/ray_caster.h), all in turns in one run:
// bench_peaks SCENE.json SETTINGS.json DATA...
//
// SETTINGS is {"repetitions": N, "settings": [...]}. Each setting has a method (postclassified,
// preintegrated, or one of the renderer's) and, as far as they apply, step (smallest spacings) or footprints
// (s_k), peaks (off, both, only; of the paper's methods also either), most (peaks of a segment), table
// (entries per edge), interpolation (as in a scene), adaptive (what longer steps follow: variance or bounds
// of macrocells, opacity, or gradient), tolerance (of bounds and of gradient), leaps (over blocks of empty
// macrocells; false: every macrocell is visited), opaque (transmittance at which rays end), samples, truth
// (a reference picture, which may be smaller by an odd factor), picture (a file to write). Prints one JSON
// object for each: seconds is the median of the repetitions, and null without.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/resolution.h"
#include "renderer/data/shared_macrocells.h"
#include "renderer/io/image_file.h"
#include "renderer/metrics/metrics.h"
#include "renderer/renderer.h"
#include "server/commands/scene_arguments.h"
#include "tests/bench/peaks/cell_rates.h"
#include "tests/bench/peaks/ray_caster.h"

namespace scolopax {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::badInput, "bench_peaks: " + what); }

/// A picture and its costs.
struct Drawn {
  Image image;
  double seconds = 0, prepareSeconds = 0;  ///< of the picture, and of tables or plans before it
  std::optional<double> samples, fetches;  ///< per pixel; fetches include those of shading
};

struct Data {
  std::shared_ptr<const Volume> volume;
  Scene scene;
};

bool isOfPaper(const json& setting) {
  const std::string method = setting.at("method");
  return method == "postclassified" || method == "preintegrated";
}

template <std::size_t N>
std::size_t indexOf(const NamedValue (&list)[N], const std::string& name) {
  const auto* found =
      std::find_if(list, list + N, [&](const NamedValue& known) { return known.name == name; });
  if (found == list + N) fail("there is no '" + name + "'");
  return std::size_t(found - list);
}

peaks::Mode modeOf(const json& setting) {
  const std::string peaks = setting.value("peaks", "off");
  if (peaks == "either") return peaks::Mode::either;
  switch (Peaks(indexOf(kPeaks, peaks))) {
    case Peaks::both:
      return peaks::Mode::both;
    case Peaks::only:
      return peaks::Mode::only;
    default:
      return peaks::Mode::off;
  }
}

peaks::StepLaw lawOf(const json& setting, const Scene& scene, const Grid& grid) {
  if (setting.contains("footprints"))
    return peaks::differentialLaw(setting["footprints"], scene.camera, scene.height, grid);
  return peaks::uniformLaw(setting.value("step", 1.0) * grid.smallestSpacing());
}

Interpolation interpolationOf(const json& setting) {
  return Interpolation(indexOf(kInterpolations, setting.value("interpolation", "trilinear")));
}

/// Codes of macrocells as in MajorantView, with which a walk leaps over no block.
std::vector<kernel::TotalCode> codesWithoutLeaps(const kernel::MajorantView& majorants) {
  const glm::ivec3 cells = majorants.cells;
  const std::size_t count = std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z);
  std::vector<kernel::TotalCode> codes(majorants.totals, majorants.totals + count);
  for (kernel::TotalCode& code : codes)
    if (code >= kernel::kEmptyCode) code = kernel::codeOfEmpty(1);
  return codes;
}

/// For every macrocell, how many steps may be taken at once; none: 1.
std::vector<int> ratesOf(const json& setting, const Data& data, const ChannelAppearance& appearance) {
  const std::string adaptive = setting.value("adaptive", "");
  const Channel& channel = data.volume->channels()[0];
  const Grid& grid = data.volume->grid();
  const int macrocell = data.scene.macrocell;
  if (adaptive == "variance") return peaks::cellRates(channel, grid.dims, macrocell);
  if (adaptive == "bounds")
    return peaks::boundedRates(channel, grid, macrocell, appearance,
                               setting.value("step", 1.0) * grid.smallestSpacing(),
                               setting.value("tolerance", 0.0));
  if (adaptive != "" && adaptive != "opacity" && adaptive != "gradient")
    fail("adaptive: expected variance, bounds, opacity or gradient");
  return {};
}

/// Casts a ray through every pixel's centre.
void castRays(const peaks::RayCaster& caster, Drawn& drawn) {
  Image& image = drawn.image;
  std::vector<peaks::Counts> rows(std::size_t(image.height));
  const auto begin = Clock::now();
  tbb::parallel_for(0, image.height, [&](int y) {
    peaks::Counts counts;
    for (int x = 0; x < image.width; ++x)
      image.pixels[std::size_t(y) * std::size_t(image.width) + std::size_t(x)] = caster(x, y, counts);
    rows[std::size_t(y)] = counts;
  });
  drawn.seconds = secondsSince(begin);
  double samples = 0, fetches = 0;
  for (const peaks::Counts& row : rows) {
    samples += double(row.samples);
    fetches += double(row.samples + row.gradient);
  }
  drawn.samples = samples / double(image.pixels.size());
  drawn.fetches = fetches / double(image.pixels.size());
}

Drawn drawPaper(const json& setting, const Data& data) {
  Scene scene = data.scene;
  ChannelAppearance& appearance = scene.channels.at(0);
  appearance.peaks = Peaks::off;
  appearance.isovalues.clear();
  appearance.interpolation = interpolationOf(setting);
  scene.method = Method::raymarch;
  const RenderPlan plan(data.volume, scene);
  kernel::SceneView view = plan.view();
  const std::vector<kernel::TotalCode> codes = codesWithoutLeaps(view.majorants);
  if (!setting.value("leaps", true)) view.majorants.totals = codes.data();
  if (scene.channels.size() != 1 || view.channelCount != 1 || appearance.gamma != 1 || scene.shadows ||
      appearance.gradientOpacity)
    fail("expected one visible channel with gamma 1, and no shadows or gradientOpacity");

  Drawn drawn;
  drawn.image = {scene.width, scene.height,
                 std::vector<glm::vec4>(std::size_t(scene.width) * std::size_t(scene.height))};
  const peaks::Mode mode = modeOf(setting);
  const Grid& grid = data.volume->grid();
  std::optional<peaks::PreintegratedTable> means;
  std::optional<peaks::PeakTable> found;
  const auto begin = Clock::now();
  if (setting.at("method") == "preintegrated") means.emplace(view.channels[0], setting.value("table", 1024));
  if (mode != peaks::Mode::off)
    found.emplace(peaks::surfacesAtPeaks(appearance.opacity, view.channels[0], grid.smallestSpacing()),
                  std::min(setting.value("most", 4), peaks::PeakTable::kMost));
  drawn.prepareSeconds = secondsSince(begin);
  const std::vector<int> rates = ratesOf(setting, data, appearance);
  const std::string adaptive = setting.value("adaptive", "");
  castRays(peaks::RayCaster({view, lawOf(setting, scene, grid), means ? &*means : nullptr,
                             found ? &*found : nullptr, mode, rates.empty() ? nullptr : &rates,
                             float(setting.value("opaque", kOpaqueTransmittance)), adaptive == "opacity",
                             adaptive == "gradient" ? setting.value("tolerance", 0.0f) : 0.0f}),
           drawn);
  return drawn;
}

/// With `counting`, which takes time, fetches are counted.
Drawn drawOurs(const json& setting, const Data& data, bool counting, std::uint32_t seed) {
  Scene scene = data.scene;
  scene.method = Method(indexOf(kMethods, setting.at("method")));
  if (hasStep(scene.method)) scene.step = setting.value("step", 1.0);
  scene.channels.at(0).peaks = Peaks(indexOf(kPeaks, setting.value("peaks", "off")));
  scene.channels.at(0).interpolation = interpolationOf(setting);
  scene.seed = seed;
  const auto renderer = makeCpuRenderer(data.volume, 0);
  if (counting) renderer->countCosts();
  Drawn drawn;
  auto begin = Clock::now();
  renderer->setScene(scene);
  drawn.prepareSeconds = secondsSince(begin);
  const std::atomic<bool> never = false;
  begin = Clock::now();
  while (renderer->samples() < setting.value("samples", 1u)) renderer->renderSample(never);
  drawn.seconds = secondsSince(begin);
  drawn.image = renderer->image();
  if (counting) drawn.fetches = double(renderer->stats().fetches) / double(drawn.image.pixels.size());
  return drawn;
}

Drawn draw(const json& setting, const Data& data, int repetition) {
  if (isOfPaper(setting)) return drawPaper(setting, data);
  return drawOurs(setting, data, repetition == 0, data.scene.seed + std::uint32_t(repetition));
}

/// The pixels whose centres are also pixel centres of a picture of this width, smaller by an odd factor.
Image thinned(const Image& image, int width) {
  const int factor = image.width / std::max(width, 1);
  if (factor % 2 == 0 || factor * width != image.width) fail("the reference's picture has the wrong size");
  Image small{width, image.height / factor, {}};
  for (int y = factor / 2; y < image.height; y += factor)
    for (int x = factor / 2; x < image.width; x += factor)
      small.pixels.push_back(image.pixels[std::size_t(y) * std::size_t(image.width) + std::size_t(x)]);
  return small;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Counts and errors of a first picture, which also warms up the renderer.
ordered_json describe(const json& setting, const Data& data, const Drawn& drawn) {
  const auto number = [](const std::optional<double>& value) {
    return value ? ordered_json(*value) : ordered_json();
  };
  ordered_json result = {{"seconds", nullptr},
                         {"prepareMs", 1e3 * drawn.prepareSeconds},
                         {"samplesPerPixel", number(drawn.samples)},
                         {"fetchesPerPixel", number(drawn.fetches)}};
  if (setting.contains("truth")) {
    const Image truth = io::readImage(setting["truth"].get<std::string>());
    const ImageDifference difference = compareImages(thinned(drawn.image, truth.width), truth);
    result["rmse"] = difference.rmse;
    result["max"] = difference.maximum;
  }
  if (setting.contains("picture"))
    io::writeImage(setting["picture"].get<std::string>(), drawn.image, data.scene.background);
  return result;
}

void run(const std::string& sceneFile, const std::string& settingsFile,
         const std::vector<std::filesystem::path>& files) {
  const auto resolved = resolveScene({sceneFile, files, {}});
  Data data{resolved->dataset->load(resolved->time), resolved->render};
  data.scene.filter = PixelFilter::point;
  const auto held =
      sharedMacrocells(data.volume, data.scene.macrocell);  // keeps them, so that they are built once
  std::ifstream file(settingsFile);
  const json all = json::parse(file);
  const json& settings = all.at("settings");
  ordered_json results = ordered_json::array();
  for (const json& setting : settings) results.push_back(describe(setting, data, draw(setting, data, 0)));
  std::vector<std::vector<double>> seconds(settings.size());
  for (int repetition = 1; repetition <= all.at("repetitions").get<int>(); ++repetition)
    for (std::size_t i = 0; i < settings.size(); ++i)
      seconds[i].push_back(draw(settings[i], data, repetition).seconds);
  for (std::size_t i = 0; i < settings.size(); ++i)
    if (!seconds[i].empty()) results[i]["seconds"] = median(seconds[i]);
  std::printf("%s\n", results.dump(1).c_str());
}

}  // namespace
}  // namespace scolopax

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "bench_peaks SCENE.json SETTINGS.json DATA...\n");
    return 2;
  }
  try {
    scolopax::run(argv[1], argv[2], {argv + 3, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
