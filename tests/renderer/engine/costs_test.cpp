// SPDX-License-Identifier: Apache-2.0
// The engine counts all that a picture of Method::automatic takes, also its corrections.
#include "renderer/engine/costs.h"

#include <gtest/gtest.h>

#include "renderer/launcher.h"
#include "tests/support/orbitals.h"
#include "tests/support/statistics.h"

namespace scolopax {
namespace {

using namespace test;

/// Runs kernels on the CPU, sums up what the passes of pictures this wide cost, and pretends that a ray was
/// truncated in each.
class TallyingLauncher : public Launcher {
 public:
  TallyingLauncher(int width, RenderStats* tally) : width_(width), tally_(tally) {}
  std::string_view name() const override { return "tallying"; }
  void run(const std::function<void()>& f) override { cpu_->run(f); }
  void upload(const std::shared_ptr<const RenderPlan>&, const std::stop_token&) override {}
  bool uploadTakesLong(const RenderPlan&, const Scene&) const override { return false; }
  bool launch(const Pass& given) override {
    if (given.scene.width != width_) return cpu_->launch(given);  // a thumbnail
    std::vector<kernel::SampleCost> own(std::size_t(width_) * std::size_t(given.scene.height));
    Pass pass = given;
    pass.cost = own.data();
    const bool complete = cpu_->launch(pass);
    ++own[0].truncated;
    for (std::size_t i = 0; i < own.size(); ++i) {
      *tally_ =
          withWork(*tally_, {0, own[i].fetches, own[i].cellSteps, own[i].randomBlocks, own[i].truncated});
      if (given.cost) kernel::addCost(&given.cost[i], own[i]);
    }
    return complete;
  }

 private:
  const int width_;
  RenderStats* const tally_;
  const std::unique_ptr<Launcher> cpu_ = makeCpuLauncher(2);
};

/// A scene that has corrections after few samples.
Scene costlyScene(const Volume& volume) {
  Scene scene = orbitalScene(volume);
  scene.method = Method::automatic;
  scene.filter = PixelFilter::point;
  return scene;
}

TEST(Costs, AreAllThatThePassesOfSamplesAndCorrectionsCost) {
  const auto volume = orbitals();
  const Scene scene = costlyScene(*volume);
  RenderStats tally;
  const auto renderer = makeRenderer(std::make_unique<TallyingLauncher>(scene.width, &tally), volume);
  renderer->countCosts();
  renderer->setScene(scene);
  for (int i = 0; i < 64; ++i) renderer->renderSample(kNever);
  ASSERT_GT(renderer->choice().corrections.size(), 0u);
  const RenderStats found = renderer->stats();
  EXPECT_EQ(found.fetches, tally.fetches);
  EXPECT_EQ(found.cellSteps, tally.cellSteps);
  EXPECT_EQ(found.randomBlocks, tally.randomBlocks);
  EXPECT_EQ(found.truncatedRays, tally.truncatedRays);
  EXPECT_GT(found.truncatedRays, 64u);  // some in corrections
  EXPECT_EQ(found.rays, 64u * std::uint64_t(scene.width) * std::uint64_t(scene.height));
}

TEST(Costs, OfAPictureWithCorrectionsExceedThoseOfItsSamples) {
  const auto volume = orbitals();
  Scene scene = costlyScene(*volume);
  const auto fetchesOf = [&](const Scene& drawn) {
    const auto renderer = makeCpuRenderer(volume, 2);
    renderer->countCosts();
    renderer->setScene(drawn);
    for (int i = 0; i < 64; ++i) renderer->renderSample(kNever);
    return std::pair(renderer->stats().fetches, renderer->choice());
  };
  const auto [all, choice] = fetchesOf(scene);
  scene.method = choice.method;
  scene.step = choice.step;
  EXPECT_GT(all, fetchesOf(scene).first);
}

TEST(Costs, OfAovsAreThoseOfTheSamples) {
  const auto volume = orbitals();
  const Scene scene = costlyScene(*volume);
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->countCosts();
  renderer->recordAovs();
  renderer->setScene(scene);
  const auto recorded = [&] {
    const AovValues values = renderer->aov(Aov::cost);
    double sum = 0;
    for (const float value : values.values) sum += value;
    return sum * renderer->samples();
  };
  renderer->renderSample(kNever);
  EXPECT_NEAR(recorded(), double(renderer->stats().fetches), 1e-3 * recorded());
  while (renderer->samples() < 64) renderer->renderSample(kNever);
  ASSERT_GT(renderer->choice().corrections.size(), 0u);
  EXPECT_LT(recorded(), 0.999 * double(renderer->stats().fetches));
}

}  // namespace
}  // namespace scolopax
