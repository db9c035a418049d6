// SPDX-License-Identifier: Apache-2.0
// Loads as a whole: memory, progress, end; and how parts of a file are read.
#include "renderer/io/loading.h"

#include <gmock/gmock.h>

#include <fstream>
#include <optional>

#include "renderer/core/sanitizers.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A field of /proc/self/status, in bytes.
std::uint64_t statusBytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == field + ":" && status >> kibibytes) return kibibytes << 10;
  }
  return 0;
}

/// By how much the resident memory grew beyond what it was before, at most, during the call. None if the
/// system does not tell.
template <class F>
std::optional<std::uint64_t> peakGrowth(F&& call) {
  std::ofstream("/proc/self/clear_refs") << "5\n";  // sets the peak to the present value
  const std::uint64_t before = statusBytes("VmRSS"), peakBefore = statusBytes("VmHWM");
  if (before == 0 || peakBefore > before + (std::uint64_t(8) << 20)) return std::nullopt;
  call();
  return statusBytes("VmHWM") - before;
}

/// A file of zeros that takes no space.
std::filesystem::path zeros(const TempDir& folder, const std::string& name, std::uint64_t bytes) {
  const auto path = writeBytes(folder / name, "");
  std::filesystem::resize_file(path, bytes);
  return path;
}

/// 40 MiB in memory for each channel: larger than what malloc keeps for itself.
constexpr std::uint64_t kVoxels = 256 * 256 * 320;

TEST(Loads, PeakAtNotMuchMoreThanTheData) {
  if (SCOLOPAX_SANITIZED) GTEST_SKIP() << "sanitizers keep freed memory";
  const TempDir folder;
  struct Row {
    const char* what;
    std::vector<std::filesystem::path> paths;
    std::uint64_t keptBytes;  ///< per voxel, all channels
  };
  const std::string size = "_256x256x320_";
  for (const Row& row :
       {Row{"channels of one type",
            {zeros(folder, "a" + size + "uint16.raw", 2 * kVoxels),
             zeros(folder, "b" + size + "uint16.raw", 2 * kVoxels),
             zeros(folder, "c" + size + "uint16.raw", 2 * kVoxels)},
            6},
        Row{"numbers that are rounded", {zeros(folder, "d" + size + "float64.raw", 8 * kVoxels)}, 4},
        Row{"integers that fit", {zeros(folder, "e" + size + "int32.raw", 4 * kVoxels)}, 2}}) {
    std::shared_ptr<const Volume> volume;
    const auto growth = peakGrowth([&] { volume = loadDatasets(row.paths, kTestLimit, {}).at(0).volume; });
    if (!growth) GTEST_SKIP() << "the peak of the resident memory is unknown";
    const double data = double(row.keptBytes * kVoxels);
    EXPECT_LT(double(*growth), 1.3 * data) << row.what;
    EXPECT_GT(double(*growth), 0.9 * data) << row.what << ": the measurement is wrong";
  }
}

TEST(Loads, OfIntegersThatTurnOutTooLargePeakAtNotMuchMoreThanTheData) {
  if (SCOLOPAX_SANITIZED) GTEST_SKIP() << "sanitizers keep freed memory";
  const TempDir folder;
  const auto path = zeros(folder, "a_256x256x320_int32.raw", 4 * kVoxels);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(-4, std::ios::end);
  file.write("\1\2\3\4", 4);
  file.close();
  const auto growth = peakGrowth([&] { loadDatasets(std::vector{path}, kTestLimit, {}); });
  if (!growth) GTEST_SKIP() << "the peak of the resident memory is unknown";
  EXPECT_LT(double(*growth), 1.3 * 4 * kVoxels);
}

TEST(Loads, TellTheBytesThatAreReadAndThenThatTheyMeasure) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{zeros(folder, "a_64x64x64_uint16.raw", 1 << 19),
                                                 zeros(folder, "b_64x64x64_float64.raw", 1 << 21)};
  std::vector<std::uint64_t> reading;
  std::vector<std::string> stages;
  loadVolume(openDatasets(paths).at(0), 0, 0, {.progress = [&](const Progress& progress) {
               EXPECT_EQ(progress.allBytes, (1u << 19) + (1u << 21));
               if (stages.empty() || stages.back() != progress.stage) stages.emplace_back(progress.stage);
               if (progress.stage == "reading") reading.push_back(progress.doneBytes);
             }});
  EXPECT_THAT(stages, ElementsAre("reading", "measuring"));
  EXPECT_EQ(reading.front(), 0u);
  EXPECT_GT(reading.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(reading));
  EXPECT_LE(reading.back(), (1u << 19) + (1u << 21));
}

TEST(Loads, EndSoonOnceTheyAreToEnd) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{zeros(folder, "a_256x256x256_uint8.raw", 1 << 24)};
  const auto dataset = openDatasets(paths).at(0);
  for (const char* stage : {"reading", "measuring"}) {
    std::stop_source stop;
    std::uint64_t done = 0;
    const auto progress = [&](const Progress& now) {
      done = now.doneBytes;
      if (now.stage == stage && (now.doneBytes > 0 || now.stage == "measuring")) stop.request_stop();
    };
    try {
      loadVolume(dataset, 0, 0, {.progress = progress, .stop = stop.get_token()});
      ADD_FAILURE() << "was not cancelled while " << stage;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
    }
    if (std::string(stage) == "reading") {
      EXPECT_LT(done, std::uint64_t(1) << 22);
    }
  }
}

/// A file of two channels whose voxels are 10 * channel + time, and 100 more at level 1, without a file.
VolumeFile invented(const TempDir& folder) {
  VolumeFile file{writeBytes(folder / "a.what", "x")};
  file.volumes = {{.levels = {Grid{{4, 1, 1}}, Grid{{2, 1, 1}}},
                   .times = {.count = 3},
                   .channels = {{.name = "zero"}, {.name = "one", .slope = 2, .intercept = 1}}}};
  file.read = [](const VolumeInfo& volume, const Part& part, Loading& loading) {
    auto writers = makeWriters("a.what", volume, part, loading);
    for (std::size_t i = 0; i < writers.size(); ++i)
      writers[i].fill(double(100 * part.level + 10 * part.channels[i] + part.time));
    return takeAll(writers);
  };
  return file;
}

TEST(PartsOfFiles, AreTheChannelsOfOneLevelAndTime) {
  const TempDir folder;
  const VolumeFile file = invented(folder);
  const LoadedPart all = load(file, {.time = 2}, LoadOptions{});
  ASSERT_EQ(all.channels.size(), 2u);
  EXPECT_EQ(valuesOf(all.channels[0]), std::vector(4, 2.0));
  EXPECT_EQ(valuesOf(all.channels[1]), std::vector(4, 2 * 12.0 + 1));
  const LoadedPart one = load(file, {.level = 1, .channels = {1}}, LoadOptions{});
  EXPECT_EQ(one.grid.dims, glm::ivec3(2, 1, 1));
  ASSERT_EQ(one.channels.size(), 1u);
  EXPECT_EQ(one.channels[0].name, "one");
  EXPECT_EQ(valuesOf(one.channels[0]), std::vector(2, 2 * 110.0 + 1));
}

TEST(PartsOfFiles, ThatDoNotExistOrDoNotFitAreRefused) {
  const TempDir folder;
  const VolumeFile file = invented(folder);
  const auto errorFor = [&](const Part& part, std::uint64_t limit = kTestLimit) {
    return errorOf([&] { load(file, part, LoadOptions{.memoryLimitBytes = limit}); });
  };
  EXPECT_EQ(errorFor({}), "");
  EXPECT_THAT(errorFor({.volume = 1}), HasSubstr("a.what: volume: expected 0 to 0, found 1"));
  EXPECT_THAT(errorFor({.level = 2}), HasSubstr("level: expected 0 to 1, found 2"));
  EXPECT_THAT(errorFor({.time = 3}), HasSubstr("time: expected 0 to 2, found 3"));
  EXPECT_THAT(errorFor({.channels = {0, 2}}), HasSubstr("channel: expected 0 to 1, found 2"));
  EXPECT_THAT(errorFor({.channels = {1, 1}}), HasSubstr("channels: expected each once"));
  EXPECT_THAT(errorFor({}, 7),
              HasSubstr("4x1x1 uint8, 2 channels needs 8 bytes of memory, the limit is 7 bytes"));
}

}  // namespace
}  // namespace scolopax::io
