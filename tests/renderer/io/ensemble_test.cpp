// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ensemble.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Four members of two voxels.
constexpr float kMembers[4][2] = {{1, 5}, {2, 5}, {4, 5}, {9, 5}};

std::filesystem::path ensemble(const TempDir& folder, const float (&members)[4][2] = kMembers) {
  std::string bytes(sizeof members, '\0');
  std::memcpy(bytes.data(), members, sizeof members);
  return writeBytes(folder / "rain.nrrd",
                    "NRRD0004\ntype: float\ndimension: 4\nsizes: 2 1 1 4\nkinds: domain domain domain time\n"
                    "endian: little\nencoding: raw\n\n" +
                        bytes);
}

std::vector<Dataset> open(const std::filesystem::path& path) {
  return openDatasets({&path, 1}, {.fourthAxis = FourthAxis::member});
}

std::vector<double> ensembleValues(const Channel& channel) {
  std::vector<double> values;
  for (std::size_t i = 0; i < channel.voxels.count(); ++i)
    values.push_back(channel.slope * double(channel.voxels.as<float>()[i]) + channel.intercept);
  return values;
}

TEST(Ensemble, HasADataSetOfItsMembersAndOneOfTheirStatistics) {
  const TempDir folder;
  const auto datasets = open(ensemble(folder));
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_EQ(datasets[0].id, "rain");
  EXPECT_EQ(datasets[0].times.count, 4u);
  EXPECT_EQ(datasets[1].id, "rain-statistics");
  EXPECT_EQ(datasets[1].title, "rain.nrrd:statistics");
  EXPECT_EQ(datasets[1].times.count, 1u);
  const auto volume = loadVolume(datasets[1], 0, 0, {});
  ASSERT_EQ(volume->channels().size(), 4u);
  // Of 1, 2, 4, 9: mean 4, squared deviations 9 + 4 + 0 + 25 = 38, divided by 3.
  EXPECT_THAT(ensembleValues(volume->channels()[0]), ElementsAre(4, 5));
  EXPECT_THAT(ensembleValues(volume->channels()[1]), ElementsAre(testing::DoubleNear(38.0 / 3, 1e-5), 0));
  EXPECT_THAT(ensembleValues(volume->channels()[2]), ElementsAre(1, 5));
  EXPECT_THAT(ensembleValues(volume->channels()[3]), ElementsAre(9, 5));
}

TEST(Ensemble, IsAlsoReachedByItsName) {
  const TempDir folder;
  const auto datasets = open(ensemble(folder).string() + ":statistics");
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].channels.size(), 4u);
}

TEST(Ensemble, KeepsTheDigitsOfSmallVariancesOfLargeValues) {
  const TempDir folder;
  // Sums of squares in float would have an error of 1e5.
  const float members[4][2] = {{1e6f - 1, 0}, {1e6f + 1, 0}, {1e6f - 1, 0}, {1e6f + 1, 0}};
  const auto volume = loadVolume(open(ensemble(folder, members))[1], 0, 0, {});
  EXPECT_NEAR(ensembleValues(volume->channels()[0])[0], 1e6, 0.1);
  EXPECT_NEAR(ensembleValues(volume->channels()[1])[0], 4.0 / 3, 0.05);
}

TEST(Ensemble, HasNoStatisticsWhereAMemberHasNone) {
  const TempDir folder;
  const float members[4][2] = {{1, 1}, {NAN, 2}, {3, 3}, {4, INFINITY}};
  const auto volume = loadVolume(open(ensemble(folder, members))[1], 0, 0, {});
  for (const Channel& channel : volume->channels())
    for (const double value : ensembleValues(channel)) EXPECT_TRUE(std::isnan(value)) << channel.name;
}

TEST(Ensemble, NeedsSeveralMembers) {
  const TempDir folder;
  const auto path = writeBytes(folder / "one.nrrd",
                               "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\nx");
  EXPECT_EQ(open(path).size(), 1u);
}

TEST(Ensemble, ChecksTheMemoryOfItsStatistics) {
  const TempDir folder;
  const auto datasets = open(ensemble(folder));
  EXPECT_THAT(errorOf([&] { loadVolume(datasets[1], 0, 0, {.memoryLimitBytes = 36}); }),
              HasSubstr("rain.nrrd"));
  EXPECT_NE(loadVolume(datasets[1], 0, 0, {.memoryLimitBytes = 40}), nullptr);
}

TEST(Ensemble, KeepsOnlyTheStatisticsThatAreAskedFor) {
  const TempDir folder;
  const auto file = withStatistics(openFile(ensemble(folder), {.fourthAxis = FourthAxis::time}));
  constexpr std::uint64_t kMember = 2 * sizeof(float), kStatistic = 2 * sizeof(float);
  const auto values = [&](std::vector<std::size_t> channels, std::uint64_t statistics) {
    const Part part{.volume = 1, .channels = std::move(channels)};
    std::vector<std::vector<double>> all;
    for (const ChannelSource& channel :
         load(*file, part, {.memoryLimitBytes = kMember + statistics * kStatistic}).channels)
      all.push_back(valuesOf(channel));
    return all;
  };
  EXPECT_THAT(values({0}, 1), ElementsAre(ElementsAre(4, 5)));
  EXPECT_THAT(values({1}, 2), ElementsAre(ElementsAre(testing::DoubleNear(38.0 / 3, 1e-5), 0)));
  EXPECT_THAT(values({2}, 1), ElementsAre(ElementsAre(1, 5)));
  EXPECT_THAT(values({2, 3}, 2), ElementsAre(ElementsAre(1, 5), ElementsAre(9, 5)));
  EXPECT_THAT(errorOf([&] { values({1}, 1); }), HasSubstr("statistics over 4 members"));
}

TEST(Ensemble, HasNoLeastOrMostWhereAMemberHasNoneAlsoByThemselves) {
  const TempDir folder;
  const float members[4][2] = {{1, NAN}, {-INFINITY, 2}, {3, 3}, {4, 4}};
  const auto file = withStatistics(openFile(ensemble(folder, members), {.fourthAxis = FourthAxis::time}));
  for (const ChannelSource& channel : load(*file, {.volume = 1, .channels = {2, 3}}, {}).channels)
    for (const double value : valuesOf(channel)) EXPECT_TRUE(std::isnan(value)) << channel.name;
}

TEST(Ensemble, ReportsProgressOverAllMembers) {
  const TempDir folder;
  const auto datasets = open(ensemble(folder));
  std::vector<Progress> reading;
  loadVolume(datasets[1], 0, 0, {.progress = [&](const Progress& now) {
               if (now.stage == "reading") reading.push_back(now);
             }});
  ASSERT_FALSE(reading.empty());
  for (const Progress& now : reading) EXPECT_EQ(now.allBytes, sizeof kMembers);
  EXPECT_EQ(reading.back().doneBytes, sizeof kMembers);
  EXPECT_EQ(storedBytes(datasets[1].sources[0].file->volumes[1], 0, {1, 3}), sizeof kMembers)
      << "each member is read once, for whatever statistics";
  EXPECT_EQ(storedBytes(datasets[0].sources[0].file->volumes[0], 0), sizeof kMembers / 4);
}

}  // namespace
}  // namespace scolopax::io
