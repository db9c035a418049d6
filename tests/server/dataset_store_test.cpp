// SPDX-License-Identifier: Apache-2.0
#include "server/dataset_store.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using nlohmann::json;

TEST(DatasetStore, DescribesGridAndChannels) {
  const json description = describeJson(*testing::smallStore()->first());
  EXPECT_EQ(description["id"], "small");
  EXPECT_EQ(description["dims"], json({4, 3, 2}));
  EXPECT_EQ(description["spacing"], json({1.0, 1.0, 1.0}));
  ASSERT_EQ(description["channels"].size(), 2u);
  EXPECT_EQ(description["channels"][1]["name"], "green");
  EXPECT_EQ(description["channels"][1]["type"], "u8");
  EXPECT_EQ(description["channels"][1]["minimum"], 0.0);
  EXPECT_EQ(description["channels"][1]["maximum"], 230.0);
}

TEST(DatasetStore, DescribesWhatTheFilesStateAndNothingThatTheyDoNot) {
  std::vector<ChannelSource> channels(2);
  for (auto& channel : channels) channel.voxels = VoxelBuffer(ScalarType::u8, 1);
  channels[0].look = {.color = {{0, 128, 255}}, .window = ValueRange{-1, 2.5}, .labels = true};
  const Dataset dataset(io::LoadedDataset{"d",
                                          "d",
                                          {},
                                          std::make_shared<const Volume>(Grid{}, std::move(channels)),
                                          {.count = 2, .values = {0, 0.5}, .unit = "s"},
                                          "um"});
  const json description = describeJson(dataset);
  EXPECT_EQ(description["worldUnit"], "um");
  EXPECT_EQ(description["times"], json({{"count", 2}, {"values", {0, 0.5}}, {"unit", "s"}}));
  EXPECT_EQ(description["channels"][0]["color"], "#0080ff");
  EXPECT_EQ(description["channels"][0]["window"], json({-1.0, 2.5}));
  EXPECT_EQ(description["channels"][0]["labels"], true);
  for (const char* absent : {"color", "window", "labels"})
    EXPECT_FALSE(description["channels"][1].contains(absent)) << absent;
}

TEST(DatasetStore, FindsById) {
  const auto store = testing::smallStore();
  EXPECT_EQ(store->find("other")->id(), "other");
  EXPECT_EQ(store->find("nothing"), nullptr);
}

TEST(DatasetStore, RefusesToHoldNothing) {
  EXPECT_THROW(DatasetStore(std::vector<io::LoadedDataset>()), Error);
}

TEST(DatasetStore, CountsEveryVoxelOfAChannelOnce) {
  const json histogram = histogramJson(testing::smallStore()->first()->facts()->volume, 0);
  std::uint64_t sum = 0;
  for (const json& bin : histogram["bins"]) sum += bin.get<std::uint64_t>();
  EXPECT_EQ(sum, 24u);
  EXPECT_EQ(histogram["maximum"], 23.0);
}

TEST(DatasetStore, RefusesAChannelThatIsNotThere) {
  EXPECT_THROW(histogramJson(testing::smallStore()->first()->facts()->volume, 2), protocol::ProtocolError);
  EXPECT_THROW(histogramJson(testing::smallStore()->first()->facts()->volume, -1), protocol::ProtocolError);
}

TEST(DatasetStore, KeepsTheGradientsThatItHasMeasured) {
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(1) << 30);
  const auto store = testing::smallStore(memory);
  const Dataset& dataset = *store->first();
  EXPECT_EQ(store->gradients(dataset, 1), nullptr);
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_THROW(store->measuredGradients(dataset, 1, stopped.get_token()), Error);
  EXPECT_EQ(store->gradients(dataset, 1), nullptr);
  const GradientHistogram* measured = store->measuredGradients(dataset, 1, {}).get();
  EXPECT_EQ(store->gradients(dataset, 1).get(), measured);
  EXPECT_EQ(store->measuredGradients(dataset, 1, stopped.get_token()).get(), measured)
      << "nothing is waited for";
  EXPECT_EQ(store->gradients(dataset, 0), nullptr);
  EXPECT_EQ(store->gradients(*store->find("other"), 1), nullptr);
  EXPECT_EQ(memory->used(MemoryUse::grids), measured->sizeBytes());
  EXPECT_THROW(store->gradients(dataset, 2), protocol::ProtocolError);
  EXPECT_THROW(store->measuredGradients(dataset, -1, {}), protocol::ProtocolError);
}

TEST(DatasetStore, KeepsOnlyTheGradientsThatWereAskedForLast) {
  // ThreadSanitizer does not see how TBB's threads pass on their counts, and would take minutes for the
  // races.
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(1) << 30);
  std::vector<io::LoadedDataset> datasets;
  for (std::size_t i = 0; i <= DatasetStore::kMaxGradients; ++i)
    datasets.push_back({std::to_string(i), "", {}, testing::smallVolume()});
  const DatasetStore store(std::move(datasets), memory);
  const std::size_t bytes = store.measuredGradients(*store.all()[0], 0, {})->sizeBytes();
  for (std::size_t i = 1; i < DatasetStore::kMaxGradients; ++i)
    store.measuredGradients(*store.all()[i], 0, {});
  EXPECT_NE(store.gradients(*store.all()[0], 0), nullptr);  // used last, so it is not the one evicted
  store.measuredGradients(*store.all().back(), 0, {});
  EXPECT_NE(store.gradients(*store.all()[0], 0), nullptr);
  EXPECT_EQ(store.gradients(*store.all()[1], 0), nullptr);
  EXPECT_NE(store.gradients(*store.all().back(), 0), nullptr);
  EXPECT_EQ(memory->used(MemoryUse::grids), DatasetStore::kMaxGradients * bytes);
}

TEST(DatasetStore, ProbesBetweenVoxelCentres) {
  const auto volume = testing::smallVolume();
  // Values are the voxel's index, x + 4 y + 12 z: linear, so interpolation is exact.
  const json inside = probeJson(*volume, 1.5, 0.25, 0.5);
  EXPECT_EQ(inside["inside"], true);
  EXPECT_DOUBLE_EQ(inside["values"][0], 1.5 + 4 * 0.25 + 12 * 0.5);
  EXPECT_DOUBLE_EQ(inside["values"][1], 10 * (1.5 + 4 * 0.25 + 12 * 0.5));
}

TEST(DatasetStore, ProbesTheOuterHalfVoxelWithTheEdgesValue) {
  const auto volume = testing::smallVolume();
  EXPECT_DOUBLE_EQ(probeJson(*volume, -0.4, 0, 0)["values"][0], 0.0);
  EXPECT_DOUBLE_EQ(probeJson(*volume, 3.5, 2.5, 1.5)["values"][0], 23.0);
  const json outside = probeJson(*volume, 3.6, 0, 0);
  EXPECT_EQ(outside["inside"], false);
  EXPECT_EQ(outside["values"], json({nullptr, nullptr}));
}

TEST(DatasetStore, ProbesInWorldUnitsAndDataUnits) {
  Grid grid;
  grid.dims = {2, 1, 1};
  grid.worldFromVoxel[0][0] = 10;
  grid.worldFromVoxel[3] = {100, 0, 0, 1};
  std::vector<ChannelSource> channels(2);
  for (auto& channel : channels) channel.voxels = VoxelBuffer(ScalarType::f32, 2);
  channels[0].voxels.as<float>()[0] = 1;
  channels[0].voxels.as<float>()[1] = 3;
  channels[0].slope = 2;
  channels[0].intercept = 5;
  channels[1].voxels.as<float>()[0] = 1;
  channels[1].voxels.as<float>()[1] = std::numeric_limits<float>::quiet_NaN();
  const json probe = probeJson(Volume(grid, std::move(channels)), 105, 0, 0);
  EXPECT_DOUBLE_EQ(probe["values"][0], 2 * 2 + 5);
  EXPECT_EQ(probe["values"][1], nullptr);
  EXPECT_EQ(probe["voxel"], json({0.5, 0.0, 0.0}));
}

TEST(DatasetStore, KeepsPathsBelowTheRoot) {
  const auto root = std::filesystem::path(::testing::TempDir()) / "scolopax_root_test";
  std::filesystem::remove_all(root);
  std::filesystem::create_directories(root / "inside");
  std::ofstream(root / "inside" / "a.nrrd") << "x";
  std::filesystem::create_symlink("/etc", root / "link");
  EXPECT_EQ(pathsBelowRoot({"inside/a.nrrd"}, root).front(),
            std::filesystem::canonical(root) / "inside/a.nrrd");
  EXPECT_EQ(pathsBelowRoot({"inside/a.nrrd:/../../b"}, root).front(),
            std::filesystem::canonical(root).string() + "/inside/a.nrrd:/../../b")
      << "only the file's path is a path";
  EXPECT_THROW(pathsBelowRoot({"../a.nrrd"}, root), Error);
  EXPECT_THROW(pathsBelowRoot({"link/passwd:b"}, root), Error);
  EXPECT_THROW(pathsBelowRoot({"/etc/passwd"}, root), Error);
  EXPECT_THROW(pathsBelowRoot({"link/passwd"}, root), Error);
  EXPECT_THROW(pathsBelowRoot({"a"}, root / "missing"), Error);
  EXPECT_EQ(pathsBelowRoot({"../a.nrrd"}, {}).front(), "../a.nrrd");
  std::filesystem::remove_all(root);
}

}  // namespace
}  // namespace scolopax::server
