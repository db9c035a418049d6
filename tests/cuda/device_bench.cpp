// SPDX-License-Identifier: Apache-2.0
// Measures a CUDA device for the report (tests/bench/report/gpu.md), on generated orbitals: frames, edits,
// and the rebuilding of majorants. Compares its pictures with the CPU's first. Writes JSON.
//   device_bench [--quick] [--seconds N]    everything, in at most about so many seconds (90)
//   device_bench --frames METHOD COUNT      only kernels of one method, for a profiler
#include <cuda_profiler_api.h>
#include <cuda_runtime_api.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cuda/check.h"
#include "cuda/cuda_launcher.h"
#include "cuda/device_scene.h"
#include "cuda/launch.h"
#include "cuda/rebuild_totals.h"
#include "renderer/core/error.h"
#include "renderer/data/sampling.h"
#include "renderer/data/shared_macrocells.h"
#include "renderer/generate/orbitals.h"
#include "renderer/renderer.h"

namespace scolopax {
namespace {

using cuda::check;
using Clock = std::chrono::steady_clock;

/// How much is measured.
struct Extent {
  int edge = 256;  ///< voxels
  std::vector<int> channels{4, 12}, macrocells{4, 2, 8};
  std::vector<glm::ivec2> sizes{{1024, 1024}, {2560, 1440}};
  glm::ivec2 compared{320, 200};  ///< with the CPU's picture
  double secondsPerPoint = 0.15;
  std::size_t mostFrames = 100, edits = 30;
};
const Extent kQuick{24, {4}, {4, 2}, {{32, 24}}, {21, 14}, 0.001, 2, 2};

struct LightOfScene {
  const char* name;
  bool shading, shadows;
};
constexpr LightOfScene kLights[] = {{"emission-absorption", false, false},
                                    {"shading", true, false},
                                    {"shadows", false, true},
                                    {"both", true, true}};
constexpr Method kMeasured[] = {Method::superposed, Method::syncDda, Method::nDda, Method::raymarch,
                                Method::hybrid};
const std::atomic<bool> kNever = false;

std::shared_ptr<const Volume> orbitals(int edge, int channels) {
  GeneratedVolume made = generateOrbitals(edge, channels);
  return std::make_shared<const Volume>(made.grid, std::move(made.channels));
}

/// The scenes orbitals and many of tests/bench/scenes.
Scene sceneOf(const Volume& volume, glm::ivec2 size) {
  const bool many = volume.channels().size() > 4;
  Scene scene;
  scene.width = size.x;
  scene.height = size.y;
  scene.seed = 1;
  scene.step = 1;
  scene.camera = {{-57, -73, 40}, {0, 0, 0}, {0, 0, 1}, 34, {}};
  scene.lights = {{LightType::directional, {-1, 0.35, -0.7}, {1, 1, 1}, 1.2}};
  for (std::size_t n = 0; n < volume.channels().size(); ++n) {
    ChannelAppearance channel;
    channel.rangeHi = volume.channels()[n].histogram.maximum;
    channel.density = many ? 5 : 4;
    channel.opacity = {{0, 0}, {0.05, many ? 0.0 : 0.05}, {1, 1}};
    const double hue = double(n) / double(volume.channels().size());
    channel.color = {{0, {hue, 1 - hue, double(n % 3) / 2}}};
    scene.channels.push_back(std::move(channel));
  }
  return scene;
}

Scene withLight(Scene scene, const LightOfScene& light) {
  scene.shading = light.shading;
  scene.shadows = light.shadows;
  return scene;
}

/// Opacity at 0.2 of the first channel's range, so that scenes differ by an edit of its curve.
Scene edited(Scene scene, std::size_t edit) {
  auto& opacity = scene.channels[0].opacity;
  opacity.insert(opacity.end() - 1, {0.2, 0.1 + 0.01 * double(edit % 10)});
  return scene;
}

double millisecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}
/// The value that the share `at` of the values are below.
double quantile(std::vector<double> values, double at) {
  const auto place = std::ptrdiff_t(double(values.size() - 1) * at + 0.5);
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[std::size_t(place)];
}
double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

/// Calls frame(i), which returns milliseconds, after a few calls to warm up.
template <class F>
std::vector<double> times(const Extent& extent, F&& frame) {
  const std::size_t warmUp = std::min<std::size_t>(5, extent.mostFrames), least = 5;
  for (std::size_t i = 0; i < warmUp; ++i) frame(i);
  std::vector<double> found;
  const auto begin = Clock::now();
  while (found.size() < extent.mostFrames &&
         (found.size() < least || millisecondsSince(begin) < 1e3 * extent.secondsPerPoint))
    found.push_back(frame(warmUp + found.size()));
  return found;
}

/// Times kernels, with nothing else on the device.
class KernelTimer {
 public:
  KernelTimer() {
    for (cudaEvent_t* event : {&begin_, &end_})
      check(cudaEventCreateWithFlags(event, cudaEventDefault), "creating an event");
  }
  KernelTimer(const KernelTimer&) = delete;
  KernelTimer& operator=(const KernelTimer&) = delete;
  ~KernelTimer() {
    for (const cudaEvent_t event : {begin_, end_}) cudaEventDestroy(event);
  }
  /// Milliseconds of the kernel that start() starts on the default stream.
  template <class F>
  double run(F&& start) {
    float ms = 0;
    check(cudaEventRecord(begin_, nullptr), "starting a kernel");
    check(start(), "starting a kernel");
    check(cudaEventRecord(end_, nullptr), "starting a kernel");
    check(cudaEventSynchronize(end_), "rendering");
    check(cudaEventElapsedTime(&ms, begin_, end_), "rendering");
    return ms;
  }

 private:
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
};

/// A volume on the device, and scenes of it: whole frames by one kernel, which leaves them on the device.
class DeviceFrames {
 public:
  explicit DeviceFrames(std::shared_ptr<const Volume> volume)
      : volume_(std::move(volume)), onDevice_(volume_, *memory_, uploader_) {}

  void set(const Scene& scene) {
    plan_ = std::make_shared<const RenderPlan>(volume_, scene, plan_.get());
    auto planes = onDevice_.upload(plan_->visibleChannels(), [] { return false; });
    scene_ =
        std::make_unique<cuda::DeviceScene>(plan_, std::move(*planes), *memory_, uploader_, scene_.get());
    pixels_ = memory_->allocate(std::size_t(scene.width) * std::size_t(scene.height) * sizeof(glm::vec4));
  }
  const RenderPlan& plan() const { return *plan_; }
  /// Milliseconds of a frame.
  double frame(std::size_t number) {
    const Scene& scene = plan_->scene();
    const cuda::DeviceBand band{.scene = scene_->viewOf(plan_->view()),
                                .number = sampleNumber(scene.sampling, std::uint32_t(number)),
                                .firstRow = 0,
                                .rows = scene.height,
                                .pixels = reinterpret_cast<glm::vec4*>(pixels_.get())};
    const cuda::LaunchFunction launch = cuda::chooseLaunch(
        instanceOf(scene.method, scene.blend, plan_->view()), band, plan_->view().channels);
    return timer_.run([&] { return launch(band, nullptr); });
  }
  std::size_t cells() const {
    const glm::ivec3 cells = plan_->view().majorants.cells;
    return std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z);
  }
  /// Milliseconds of computing the totals of all macrocells.
  double rebuild() {
    const cuda::DeviceBytes totals = memory_->allocate(cells() * sizeof(kernel::TotalCode));
    return timer_.run([&] {
      return cuda::rebuildTotals(scene_->viewOf(plan_->view()).majorants,
                                 reinterpret_cast<kernel::TotalCode*>(totals.get()), nullptr, nullptr);
    });
  }

 private:
  const std::shared_ptr<cuda::DeviceMemory> memory_ =
      std::make_shared<cuda::DeviceMemory>([] { return false; });
  cuda::Uploader uploader_;
  const std::shared_ptr<const Volume> volume_;
  cuda::DeviceVolume onDevice_;
  std::shared_ptr<const RenderPlan> plan_;
  std::unique_ptr<const cuda::DeviceScene> scene_;
  cuda::DeviceBytes pixels_;
  KernelTimer timer_;
};

std::unique_ptr<Renderer> deviceRenderer(const std::shared_ptr<const Volume>& volume) {
  return makeRenderer(
      cuda::makeCudaLauncher(cuda::openDevices({0}), 0, {.continueOnCpu = false, .log = nullptr}), volume);
}

/// A list of JSON objects, printed as they are measured.
class Rows {
 public:
  explicit Rows(const char* name) { std::printf(",\n \"%s\": [", name); }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows() { std::printf("]"); }
  template <class... Values>
  void add(const char* format, Values... values) {
    std::printf("%s\n  {", first_ ? "" : ",");
    std::printf(format, values...);
    std::printf("}");
    first_ = false;
  }

 private:
  bool first_ = true;
};

/// As C's functions take it: the names are literals.
const char* wordOf(Method method) { return nameOf(method).data(); }

/// Pixels of a picture of each method that differ from the CPU's.
void compareWithCpu(const Extent& extent, const std::shared_ptr<const Volume>& volume) {
  Rows rows("parity");
  const auto device = deviceRenderer(volume), cpu = makeCpuRenderer(volume, 0);
  for (const LightOfScene& light : {kLights[0], kLights[3]})
    for (const Method method : kMeasured) {
      Scene scene = withLight(sceneOf(*volume, extent.compared), light);
      scene.method = method;
      for (Renderer* renderer : {device.get(), cpu.get()}) {
        renderer->setScene(scene);
        renderer->renderSample(kNever);
      }
      const Image found = device->image(), expected = cpu->image();
      std::size_t different = 0;
      for (std::size_t i = 0; i < found.pixels.size(); ++i)
        different += std::memcmp(&found.pixels[i], &expected.pixels[i], sizeof found.pixels[i]) != 0;
      rows.add("\"light\": \"%s\", \"method\": \"%s\", \"pixels\": %zu, \"different\": %zu", light.name,
               wordOf(method), found.pixels.size(), different);
    }
}

/// Edits of one channel's curve: from the call that sets the scene to the frame in the host's memory.
void measureEdits(const Extent& extent, const std::vector<std::shared_ptr<const Volume>>& volumes) {
  Rows rows("edits");
  for (const auto& volume : volumes) {
    const auto renderer = deviceRenderer(volume);
    for (const LightOfScene& light : {kLights[0], kLights[3]})
      for (const Method method : {Method::superposed, Method::raymarch, Method::automatic}) {
        Scene scene = withLight(sceneOf(*volume, extent.sizes[0]), light);
        scene.method = method;
        std::vector<double> toFrame, toScene, rebuild;
        for (std::size_t edit = 0; edit <= extent.edits; ++edit) {
          const Scene next = edited(scene, edit);
          const auto begin = Clock::now();
          const RebuildStats stats = renderer->setScene(next);
          const double set = millisecondsSince(begin);
          renderer->renderSample(kNever);
          if (edit == 0) continue;  // builds macrocells and uploads channels
          toFrame.push_back(millisecondsSince(begin));
          toScene.push_back(set);
          rebuild.push_back(stats.rebuildMs);
        }
        rows.add(
            "\"channels\": %zu, \"light\": \"%s\", \"method\": \"%s\", \"chosen\": \"%s\", \"frameMs\": "
            "%.4f, "
            "\"frameP95Ms\": %.4f, \"sceneMs\": %.4f, \"rebuildMs\": %.4f",
            volume->channels().size(), light.name, wordOf(method), wordOf(renderer->choice().method),
            median(toFrame), quantile(toFrame, 0.95), median(toScene), median(rebuild));
      }
  }
}

/// The same edit without a picture, by size of macrocells, and the device's share of it.
void measureRebuilding(const Extent& extent, const std::vector<std::shared_ptr<const Volume>>& volumes) {
  Rows rows("rebuild");
  for (const auto& volume : volumes) {
    DeviceFrames frames(volume);
    for (const int macrocell : extent.macrocells) {
      Scene scene = sceneOf(*volume, {16, 16});
      scene.macrocell = macrocell;
      std::vector<double> host, all, device;
      for (std::size_t edit = 0; edit <= extent.edits; ++edit) {
        const auto begin = Clock::now();
        frames.set(edited(scene, edit));
        if (edit == 0) continue;
        all.push_back(millisecondsSince(begin));
        host.push_back(frames.plan().rebuilt().rebuildMs);
        device.push_back(frames.rebuild());
      }
      rows.add(
          "\"channels\": %zu, \"macrocell\": %d, \"cells\": %zu, \"hostMs\": %.4f, \"kernelMs\": %.4f, "
          "\"sceneMs\": %.4f",
          volume->channels().size(), macrocell, frames.cells(), median(host), median(device), median(all));
    }
  }
}

/// Frames of every method, light, size and number of channels: in one kernel, and as the server renders them,
/// in bands, added up in the host's memory. Macrocells that matter most come first. Returns whether the time
/// was enough.
bool measureFrames(const Extent& extent, const std::vector<std::shared_ptr<const Volume>>& volumes,
                   Clock::time_point deadline) {
  Rows rows("frames");
  std::vector<std::unique_ptr<Renderer>> renderers;
  std::vector<std::unique_ptr<DeviceFrames>> kernels;
  for (const auto& volume : volumes) {
    renderers.push_back(deviceRenderer(volume));
    kernels.push_back(std::make_unique<DeviceFrames>(volume));
  }
  for (const int macrocell : extent.macrocells)
    for (const glm::ivec2 size : extent.sizes)
      for (std::size_t v = 0; v < volumes.size(); ++v) {
        const auto held = sharedMacrocells(volumes[v], macrocell);
        for (const LightOfScene& light : kLights)
          for (const Method method : kMeasured) {
            if (Clock::now() > deadline) return false;
            Scene scene = withLight(sceneOf(*volumes[v], size), light);
            scene.method = method;
            scene.macrocell = macrocell;
            kernels[v]->set(scene);
            const std::vector<double> kernel =
                times(extent, [&](std::size_t i) { return kernels[v]->frame(i); });
            Renderer& renderer = *renderers[v];
            renderer.setScene(scene);
            const std::vector<double> frame = times(extent, [&](std::size_t) {
              const auto begin = Clock::now();
              renderer.renderSample(kNever);
              return millisecondsSince(begin);
            });
            rows.add(
                "\"channels\": %zu, \"width\": %d, \"height\": %d, \"light\": \"%s\", \"macrocell\": %d, "
                "\"method\": \"%s\", \"kernelMs\": %.4f, \"frameMs\": %.4f, \"kernels\": %zu, \"frames\": "
                "%zu",
                volumes[v]->channels().size(), size.x, size.y, light.name, macrocell, wordOf(method),
                median(kernel), median(frame), kernel.size(), frame.size());
          }
        std::fprintf(stderr, "macrocells of %d, %zu channels, %dx%d\n", macrocell,
                     volumes[v]->channels().size(), size.x, size.y);
      }
  return true;
}

void measureAll(const Extent& extent, double seconds) {
  const auto deadline = Clock::now() + std::chrono::milliseconds((long long)(seconds * 1000));
  std::printf("{\"edge\": %d, \"step\": 1", extent.edge);
  std::vector<std::shared_ptr<const Volume>> volumes;
  for (const int channels : extent.channels) volumes.push_back(orbitals(extent.edge, channels));
  std::fprintf(stderr, "volumes are made\n");
  compareWithCpu(extent, volumes[0]);
  measureEdits(extent, volumes);
  measureRebuilding(extent, volumes);
  const bool complete = measureFrames(extent, volumes, deadline);
  std::printf(",\n \"complete\": %s}\n", complete ? "true" : "false");
}

/// `name`: of a method; auto is what it chooses.
void renderFrames(const Extent& extent, const std::string& name, std::size_t count) {
  const auto known = std::find_if(std::begin(kMethods), std::end(kMethods),
                                  [&](const NamedValue& method) { return method.name == name; });
  if (known == std::end(kMethods)) failBadInput("there is no method " + name);
  const auto volume = orbitals(extent.edge, extent.channels[0]);
  Scene scene = sceneOf(*volume, extent.sizes[0]);
  scene.method = Method(known - std::begin(kMethods));
  if (scene.method == Method::automatic) {
    const auto renderer = deviceRenderer(volume);
    renderer->setScene(scene);
    scene.method = renderer->choice().method;
    if (hasStep(scene.method)) scene.step = renderer->choice().step;
  }
  DeviceFrames frames(volume);
  frames.set(scene);
  for (std::size_t i = 0; i < 5; ++i) frames.frame(i);
  // Not what chose the method, nor what warms up.
  check(cudaProfilerStart(), "starting the profiler");
  for (std::size_t i = 0; i < count; ++i) frames.frame(5 + i);
  std::printf("{\"method\": \"%s\", \"step\": %g, \"rays\": %d}\n", wordOf(scene.method), scene.step,
              scene.width * scene.height);
}

int run(int argc, char** argv) {
  Extent extent;
  double seconds = 90;
  const std::vector<std::string> words(argv + 1, argv + argc);
  std::optional<std::size_t> frames;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--quick") {
      extent = kQuick;
    } else if (words[i] == "--seconds" && i + 1 < words.size()) {
      seconds = std::atof(words[++i].c_str());
    } else if (words[i] == "--frames" && i + 2 < words.size()) {
      frames = i;
      i += 2;
    } else {
      std::fprintf(stderr, "usage: device_bench [--quick] [--seconds N | --frames METHOD COUNT]\n");
      return 2;
    }
  }
  std::string why;
  if (cuda::devices(&why).empty()) throw Error(ErrorCode::device, "no CUDA device: " + why);
  if (frames)
    renderFrames(extent, words[*frames + 1], std::size_t(std::max(1, std::atoi(words[*frames + 2].c_str()))));
  else
    measureAll(extent, seconds);
  return 0;
}

}  // namespace
}  // namespace scolopax

int main(int argc, char** argv) {
  try {
    return scolopax::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "device_bench: %s\n", error.what());
    return 1;
  }
}
