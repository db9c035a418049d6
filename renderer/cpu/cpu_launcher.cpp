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

TileFunction chooseTiles(const Pass& pass) {
  const Instance instance = instanceOf(pass.method, pass.plan->scene().blend, pass.scene);
  const TileFunction packets = packetTileFunction(instance, pass.scene, fastestInstructionSet());
  return packets ? packets : visitIntegrator(instance, [&](auto type) {
    return chooseTileFunction<typename decltype(type)::type>(instance);
  });
}

class CpuLauncher final : public Launcher {
 public:
  explicit CpuLauncher(int threads) : arena_(threads > 0 ? threads : tbb::task_arena::automatic) {}

  std::string_view name() const override { return "cpu"; }

  void run(const std::function<void()>& f) override { arena_.execute(f); }

  void upload(const std::shared_ptr<const RenderPlan>&, const std::stop_token&) override {}
  bool uploadTakesLong(const RenderPlan&, const Scene&) const override { return false; }

  bool launch(const Pass& given) override {
    Pass pass = given;
    pass.scene.cancel = pass.cancel;
    const TileFunction renderTileAt = chooseTiles(pass);
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
