// SPDX-License-Identifier: Apache-2.0
// Speed against error of quadrature at the resolutions of its ladder, on the scenes of the statistical tests
// and in matter up to a thousand times as dense: bench_resolutions [SIDE, 12 pixels by default]. Prints one
// JSON object a line: RMSE over premultiplied RGBA against the reference, and the time of a sample, one
// thread.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>

#include "renderer/data/resolution.h"
#include "renderer/reference/render.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/replicates.h"

namespace scolopax {
namespace {

constexpr double kDensities[] = {1, 30, 1000};
constexpr int kRepetitions = 7;

/// One sample of every pixel at one resolution, and its fastest time.
Image draw(const std::shared_ptr<const Volume>& volume, const Scene& scene, int resolution,
           double* milliseconds) {
  const auto launcher = makeCpuLauncher(1);
  const std::atomic<bool> never = false;
  const RenderPlan plan(volume, scene, nullptr);
  kernel::SceneView view = plan.view();
  setResolution(view, resolutionAt(resolution));
  Film film;
  *milliseconds = 1e300;
  for (int i = 0; i < kRepetitions; ++i) {
    film.reset(scene.width, scene.height);
    const std::clock_t begin = std::clock();
    launcher->run([&] {
      std::vector<std::uint8_t> done(film.pixelCount());
      launcher->launch({.plan = &plan,
                        .method = scene.method,
                        .scene = view,
                        .number = sampleNumber(scene.sampling, 0),
                        .pixels = film.pass(),
                        .done = done.data(),
                        .cancel = &never,
                        .deadline = std::chrono::steady_clock::time_point::max()});
      film.add();
    });
    const double time = 1000.0 * double(std::clock() - begin) / CLOCKS_PER_SEC;
    *milliseconds = std::min(*milliseconds, time);
  }
  return film.image();
}

double rmse(const Image& found, const Image& expected) {
  double squares = 0;
  for (std::size_t i = 0; i < found.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c)
      squares += std::pow(double(found.pixels[i][c]) - double(expected.pixels[i][c]), 2);
  return std::sqrt(squares / (4.0 * double(found.pixels.size())));
}

void run(int side) {
  for (const test::TestScene which : test::kTestScenes) {
    const auto made = test::testScene(which);
    if (!made) continue;
    for (const double density : kDensities)
      for (const BlendMode blend : test::kBlends) {
        Scene scene = made->scene;
        scene.blend = blend;
        scene.method = Method::raymarch;
        scene.step = 0;
        scene.width = scene.height = side;
        for (ChannelAppearance& channel : scene.channels) channel.density *= density;
        const auto truth = reference::renderReference(*made->volume, scene, 1);
        for (int resolution = kEqualSteps; resolution < kResolutions; ++resolution) {
          double milliseconds;
          const Image image = draw(made->volume, scene, resolution, &milliseconds);
          const nlohmann::ordered_json line = {{"scene", test::kTestSceneNames[int(which)]},
                                               {"density", density},
                                               {"blend", nameOf(blend)},
                                               {"resolution", resolution},
                                               {"rmse", rmse(image, truth.image)},
                                               {"ms", milliseconds}};
          std::printf("%s\n", line.dump().c_str());
          std::fflush(stdout);
        }
      }
  }
}

}  // namespace
}  // namespace scolopax

int main(int argc, char** argv) {
  scolopax::run(argc > 1 ? std::atoi(argv[1]) : 12);
  return 0;
}
