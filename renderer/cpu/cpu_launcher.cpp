// SPDX-License-Identifier: Apache-2.0
// The CPU launcher: runs kernels over tiles of pixels with TBB.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "renderer/cpu/ray_packets.h"
#include "renderer/data/instances.h"
#include "renderer/renderer.h"

namespace scolopax {
namespace {

TileFunction chooseTiles(Scene scene, const kernel::SceneView& view) {
  scene.shadows = scene.shadows && view.lightCount > 0;  // without lights there is nothing to block
  if (hasStep(scene.method)) return quadratureTileFunction(scene, view);
  return visitIntegrator(scene,
                         [&](auto type) { return chooseTileFunction<typename decltype(type)::type>(scene); });
}

class CpuLauncher final : public Launcher {
 public:
  explicit CpuLauncher(int threads) : arena_(threads > 0 ? threads : tbb::task_arena::automatic) {}

  std::string_view name() const override { return "cpu"; }

  void run(const std::function<void()>& f) override { arena_.execute(f); }

  bool launch(const Scene& scene, const Pass& given) override {
    Pass pass = given;
    pass.scene.cancel = pass.cancel;
    const TileFunction renderTileAt = chooseTiles(scene, pass.scene);
    const int tilesX = (pass.scene.width + kTile - 1) / kTile;
    const int tilesY = (pass.scene.height + kTile - 1) / kTile;
    tbb::parallel_for(0, tilesX * tilesY, [&](int i) { renderTileAt(pass, i % tilesX, i / tilesX); });
    const std::uint8_t* end = pass.done + std::size_t(pass.scene.width) * std::size_t(pass.scene.height);
    return std::find(static_cast<const std::uint8_t*>(pass.done), end, 0) == end;
  }

 private:
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Launcher> makeCpuLauncher(int threads) { return std::make_unique<CpuLauncher>(threads); }

std::unique_ptr<Renderer> makeCpuRenderer(std::shared_ptr<const Volume> volume, int threads,
                                          std::shared_ptr<MemoryBudget> memory) {
  return makeRenderer(makeCpuLauncher(threads), std::move(volume), std::move(memory));
}

}  // namespace scolopax
