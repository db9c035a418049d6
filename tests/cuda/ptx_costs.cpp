// SPDX-License-Identifier: Apache-2.0
// Counts what the kernels execute for a scene, by light and method: instructions, loads and bytes per ray.
// Says nothing of time: but it needs no device, and does not depend on the machine. Part of the report
// (tests/bench, experiment `proxies`).
#include <fmt/core.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/data/shared_macrocells.h"
#include "server/commands/scene_arguments.h"
#include "tests/cuda/printed_sync_dda.h"
#include "tests/cuda/ptx_counts.h"
#include "tests/cuda/substitute_runtime.h"
#include "tests/cuda/uploaded_plan.h"

namespace scolopax {
namespace {

using cuda::check;
using nlohmann::ordered_json;

constexpr struct {
  const char* name;
  bool shading, shadows;
} kLights[] = {{"emission-absorption", false, false},
               {"shading", true, false},
               {"shadows", false, true},
               {"both", true, true}};

constexpr const char* kPrinted = "sync-dda, as printed";

/// Device memory that holds a copy of host memory.
template <class T>
class DeviceArray {
 public:
  explicit DeviceArray(const std::vector<T>& values) : count_(values.size()) {
    void* memory = nullptr;
    check(cudaMalloc(&memory, count_ * sizeof(T)), "allocating device memory");
    data_ = static_cast<T*>(memory);
    check(cudaMemcpy(data_, values.data(), count_ * sizeof(T), cudaMemcpyHostToDevice),
          "copying to the device");
  }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;
  ~DeviceArray() { cudaFree(data_); }
  T* data() const { return data_; }
  std::vector<T> values() const {
    std::vector<T> copy(count_);
    check(cudaMemcpy(copy.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost),
          "copying from the device");
    return copy;
  }

 private:
  T* data_ = nullptr;
  std::size_t count_;
};

/// The paper's majorants of a plan: for every macrocell, a float for every visible channel.
std::vector<float> printedMajorants(const kernel::SceneView& scene) {
  const glm::ivec3 cells = scene.majorants.cells;
  std::vector<float> majorants;
  for (std::size_t cell = 0; cell < std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z);
       ++cell)
    for (int n = 0; n < scene.channelCount; ++n) majorants.push_back(scene.majorants.bound(cell, n));
  return majorants;
}

/// What a sample of the whole picture costs per ray, with the method of the scene or by the printed listing.
ordered_json costsOf(const std::shared_ptr<const Volume>& volume, const Scene& scene, bool printed) {
  const test::UploadedPlan uploaded(volume, scene);
  const auto rays = std::size_t(scene.width) * std::size_t(scene.height);
  const DeviceArray<glm::vec4> pixels{std::vector<glm::vec4>(rays)};
  const DeviceArray<kernel::SampleCost> cost{std::vector<kernel::SampleCost>(rays)};
  const kernel::SceneView& view = uploaded.plan().view();
  const DeviceArray<float> majorants(printed ? printedMajorants(view) : std::vector<float>(1));
  cuda::DeviceBand band = uploaded.band(pixels.data());
  if (!cuda::isPlain(band, view.channels))
    failBadInput("expected a scene that needs no more than plain kernels");
  const Instance instance = instanceOf(scene.method, scene.blend, view);
  const auto run = [&] {
    // Counts are not synchronised.
    const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
    check(printed ? test::launchPrinted(band, majorants.data(), instance.lit, nullptr)
                  : cuda::chooseLaunch(instance, band, view.channels)(band, nullptr),
          "starting a kernel");
    if (const cudaError_t result = cudaDeviceSynchronize(); result != cudaSuccess)
      throw Error(ErrorCode::device, "a kernel failed: " + substitute::lastFault());
  };
  ptx::counts = {};
  run();
  const ptx::Counts counts = ptx::counts;
  band.cost = cost.data();  // not before: keeping the costs is work of its own
  run();
  std::uint64_t fetches = 0, cells = 0;
  for (const kernel::SampleCost& one : cost.values()) {
    fetches += one.fetches;
    cells += one.cellSteps;
  }
  const auto perRay = [&](std::uint64_t sum) { return double(sum) / double(rays); };
  return {{"instructions", perRay(counts.instructions)},
          {"loads", perRay(counts.loads)},
          {"bytes", perRay(counts.loadedBytes)},
          {"localLoads", perRay(counts.localLoads)},
          {"localBytes", perRay(counts.localBytes)},
          {"fetches", perRay(fetches)},
          {"cells", perRay(cells)}};
}

void run(const SceneArguments& arguments) {
  const auto resolved = resolveScene(arguments);
  const auto volume = resolved->dataset->load(resolved->time);
  Scene scene = resolved->render;
  scene.blend = BlendMode::density;
  const auto held = sharedMacrocells(volume, scene.macrocell);  // for all plans
  ordered_json points = ordered_json::array();
  const auto add = [&](const char* light, std::string_view method, bool printed) {
    ordered_json point = {{"light", light}, {"method", method}};
    point.update(costsOf(volume, scene, printed));
    points.push_back(std::move(point));
  };
  for (const auto& light : kLights) {
    scene.shading = light.shading;
    scene.shadows = light.shadows;
    for (std::size_t i = 0; i < std::size(kMethods); ++i) {
      scene.method = Method(i);
      if (scene.method != Method::automatic) add(light.name, kMethods[i].name, false);
    }
    scene.method = Method::syncDda;
    add(light.name, kPrinted, true);
  }
  const ordered_json result = {{"compiler", SCOLOPAX_PTX_COMPILER},
                               {"channels", volume->channels().size()},
                               {"width", scene.width},
                               {"height", scene.height},
                               {"macrocell", scene.macrocell},
                               {"step", scene.step},
                               {"points", points}};
  fmt::print("{}\n", result.dump(1));
}

}  // namespace
}  // namespace scolopax

int main(int argc, char** argv) {
  CLI::App app{"Counts the instructions, loads and bytes that kernels execute per ray of a scene, by method",
               "ptx_costs"};
  scolopax::SceneArguments arguments;
  scolopax::addSceneArguments(app, arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    scolopax::run(arguments);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ptx_costs: %s\n", error.what());
    return 1;
  }
}
