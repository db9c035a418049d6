// SPDX-License-Identifier: Apache-2.0
// OME metadata: places of levels, units, channels, and documents that are wrong.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

namespace scolopax::io {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// An image z4 y4 x8 with a level that halves y and x, and no chunks.
class Ngff : public testing::Test {
 protected:
  json document = multiscales("zyx", {{3, 0.5, 0.5}, {3, 1, 1}});
  json fine = array2({4, 4, 8}, {4, 4, 8}, "|u1"), coarse = array2({4, 2, 4}, {4, 2, 4}, "|u1");
  std::vector<std::string> warnings;

  json& image() { return document["multiscales"][0]; }
  json& level(std::size_t i) { return image()["datasets"][i]; }
  std::filesystem::path write() {
    return writeZarr(folder_ / "a.zarr", {{".zgroup", kGroup2},
                                          {".zattrs", document.dump()},
                                          {"0/.zarray", fine.dump()},
                                          {"1/.zarray", coarse.dump()}});
  }
  VolumeInfo open() {
    warnings.clear();
    return openFile(write(), {.warn = [this](const std::string& line) { warnings.push_back(line); }})
        ->volumes[0];
  }
  std::string error() {
    return errorOf([&] { open(); });
  }
  static glm::dvec3 originOf(const Grid& grid) { return glm::dvec3(grid.worldFromVoxel[3]); }

  TempDir folder_;
};

TEST_F(Ngff, LevelsWithoutTranslationsBeginAtTheSameCorner) {
  const VolumeInfo volume = open();
  EXPECT_EQ(originOf(volume.levels[0]), glm::dvec3(0));
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(0.5, 0.5, 3));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(1, 1, 3));
  EXPECT_EQ(originOf(volume.levels[1]), glm::dvec3(0.25, 0.25, 0));
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(Ngff, TranslationsAreTakenAsTheyStand) {
  level(0)["coordinateTransformations"].push_back({{"type", "translation"}, {"translation", {30, 10, 20}}});
  level(1)["coordinateTransformations"].push_back({{"type", "translation"}, {"translation", {30, 10, 20}}});
  const VolumeInfo volume = open();
  EXPECT_EQ(originOf(volume.levels[0]), glm::dvec3(20, 10, 30));
  EXPECT_EQ(originOf(volume.levels[1]), glm::dvec3(20, 10, 30));
}

TEST_F(Ngff, TransformationsOfTheWholeImageFollowThoseOfALevel) {
  level(0)["coordinateTransformations"].push_back({{"type", "translation"}, {"translation", {3, 1, 2}}});
  image()["coordinateTransformations"] = json::array(
      {{{"type", "scale"}, {"scale", {10, 2, 2}}}, {{"type", "translation"}, {"translation", {0, 0, 100}}}});
  const VolumeInfo volume = open();
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(1, 1, 30));
  EXPECT_EQ(originOf(volume.levels[0]), glm::dvec3(104, 2, 30));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(2, 2, 30));
  EXPECT_EQ(originOf(volume.levels[1]), glm::dvec3(104.5, 2.5, 30)) << "the corner of the finest level";
}

TEST_F(Ngff, UnitsAreShownShortAndBroughtTogether) {
  const auto units = [&](const char* z, const char* y, const char* x) {
    const char* all[] = {z, y, x};
    for (std::size_t i = 0; i < 3; ++i) image()["axes"][i]["unit"] = all[i];
    const VolumeInfo volume = open();
    return std::pair(volume.worldUnit, volume.levels[0].spacing());
  };
  EXPECT_EQ(units("micrometer", "micrometer", "micrometer"),
            std::pair(std::string("um"), glm::dvec3(0.5, 0.5, 3)));
  EXPECT_EQ(units("millimeter", "millimeter", "millimeter").first, "mm");
  EXPECT_EQ(units("nanometer", "nanometer", "nanometer").first, "nm");
  EXPECT_EQ(units("parsec", "parsec", "parsec").first, "parsec");
  const auto mixed = units("nanometer", "micrometer", "micrometer");
  EXPECT_EQ(mixed.first, "um");
  EXPECT_NEAR(mixed.second.z, 0.003, 1e-15);
  EXPECT_EQ(mixed.second.x, 0.5);
  EXPECT_EQ(units("furlong", "micrometer", "micrometer").first, "");
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("units of length for all or none")));
}

TEST_F(Ngff, TimesHaveTheValuesThatTheScaleTells) {
  document = multiscales("tzyx", {{0.5, 1, 1, 1}});
  image()["axes"][0]["unit"] = "millisecond";
  fine = array2({3, 4, 4, 8}, {1, 4, 4, 8}, "|u1");
  const VolumeInfo volume = open();
  EXPECT_EQ(volume.times.count, 3u);
  EXPECT_THAT(volume.times.values, ElementsAre(0, 0.5, 1));
  EXPECT_EQ(volume.times.unit, "ms");
  document = multiscales("tzyx", {{1, 1, 1, 1}});
  EXPECT_THAT(open().times.values, IsEmpty()) << "a scale of 1 without unit tells nothing";
}

TEST_F(Ngff, ChannelsLookAsOmeroSays) {
  document = multiscales("czyx", {{1, 1, 1, 1}});
  fine = array2({3, 4, 4, 8}, {1, 4, 4, 8}, "|u1");
  document["omero"]["channels"] =
      json::array({{{"label", "a\nb"}, {"color", "#0a0B0c"}, {"window", {{"start", 3}, {"end", 7.5}}}},
                   {{"label", 5}, {"color", "blue"}, {"window", {{"start", 9}, {"end", 9}}}}});
  const VolumeInfo volume = open();
  EXPECT_EQ(volume.channels[0].name, "ab");
  EXPECT_EQ(volume.channels[0].look.color, (std::array<std::uint8_t, 3>{10, 11, 12}));
  EXPECT_EQ(volume.channels[0].look.window->lo, 3);
  EXPECT_EQ(volume.channels[0].look.window->hi, 7.5);
  EXPECT_EQ(volume.channels[1].name, "a 1");
  EXPECT_FALSE(volume.channels[1].look.color);
  EXPECT_FALSE(volume.channels[1].look.window);
  EXPECT_EQ(volume.channels[2].name, "a 2");
  EXPECT_THAT(warnings,
              ElementsAre(HasSubstr("omero.channels[1].color: expected a colour"),
                          HasSubstr("omero.channels: expected 3, as many as the array has, found 2")));
}

TEST_F(Ngff, AxesOfOlderVersionsAreNamesOnly) {
  image()["axes"] = {"z", "y", "x"};
  for (std::size_t i = 0; i < 2; ++i) level(i).erase("coordinateTransformations");
  const VolumeInfo volume = open();
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(1));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(2, 2, 1));
}

TEST_F(Ngff, WrongMetadataAreRefusedWithTheField) {
  const json sound = document;
  const auto with = [&](const std::function<void()>& change) {
    document = sound;
    change();
    return error();
  };
  EXPECT_EQ(with([] {}), "");
  EXPECT_THAT(
      with([&] { level(0)["path"] = "../b"; }),
      HasSubstr("a.zarr/.zattrs: multiscales[0].datasets[0].path: expected a path inside of the group, "
                "found \"../b\""));
  EXPECT_THAT(with([&] { level(0)["path"] = 0; }), HasSubstr("path: expected text, found 0"));
  EXPECT_THAT(with([&] { level(0)["path"] = "gone"; }), HasSubstr("expected an array \"gone\", found none"));
  EXPECT_THAT(with([&] { image()["datasets"] = json::array(); }),
              HasSubstr("datasets: expected at least one"));
  EXPECT_THAT(with([&] { image().erase("datasets"); }), HasSubstr("datasets: expected a list, found none"));
  EXPECT_THAT(with([&] { image()["axes"] = json::array(); }), HasSubstr("axes: expected at least one axis"));
  EXPECT_THAT(with([&] { image()["axes"].erase(0); }),
              HasSubstr("scale: expected 2 numbers, one for each axis"));
  EXPECT_THAT(with([&] { image()["axes"][0] = image()["axes"][1]; }),
              HasSubstr("axes: expected t, c, z, y and x, once each, found \"y\" of 4"));
  EXPECT_THAT(with([&] {
                image()["axes"][0] = {{"name", "angle"}, {"type", "angle"}};
              }),
              HasSubstr("found \"angle\" of 4"));
  const auto scale = [&]() -> json& { return level(0)["coordinateTransformations"][0]["scale"]; };
  EXPECT_THAT(with([&] { scale() = {0, 1, 1}; }), HasSubstr("expected scales other than 0"));
  EXPECT_THAT(with([&] { scale() = {"1", 1, 1}; }), HasSubstr("scale[0]: expected a number, found \"1\""));
  EXPECT_THAT(with([&] { level(0)["coordinateTransformations"][0]["type"] = "affine"; }),
              HasSubstr("type: expected scale or translation, found \"affine\""));
  EXPECT_THAT(with([&] { image()["datasets"] = json(std::vector<json>(65, level(0))); }),
              HasSubstr("expected at most 64 elements, found 65"));
  document = sound;
  coarse["dtype"] = "<u2";
  EXPECT_EQ(open().levels.size(), 1u);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("the level is left out")));
}

TEST_F(Ngff, ALabelThatCannotBeReadIsLeftOutWithAWarning) {
  writeZarr(write(), {{"labels/.zattrs", R"({"labels": ["bad", "good"]})"},
                      {"labels/bad/.zattrs", R"({"multiscales": 5})"},
                      {"labels/good/.zattrs", multiscales("zyx", {{1, 1, 1}}).dump()},
                      {"labels/good/0/.zarray", array2({1, 1, 2}, {1, 1, 2}, "<u4").dump()}});
  std::vector<std::string> lines;
  const auto file =
      openFile(folder_ / "a.zarr", {.warn = [&](const std::string& line) { lines.push_back(line); }});
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[1].path, "labels/good");
  EXPECT_TRUE(file->volumes[1].channels[0].look.labels);
  EXPECT_THAT(lines, ElementsAre(AllOf(HasSubstr("labels/bad/.zattrs: multiscales: expected a list, found 5"),
                                       HasSubstr("left out"))));
}

TEST(NgffFolders, SeriesAndGroupsBecomeSeveralVolumes) {
  const TempDir folder;
  const std::string image = multiscales("zyx", {{1, 1, 1}}).dump();
  const std::string array = array2({1, 1, 2}, {1, 1, 2}, "|u1").dump();
  const auto pathsOf = [&](const std::string& name) {
    std::vector<std::string> paths;
    const auto file = openFile(folder / name);
    for (const VolumeInfo& volume : file->volumes) paths.push_back(volume.path);
    return paths;
  };
  const ZarrValues images{{"0/.zattrs", image},   {"0/0/.zarray", array}, {"1/.zattrs", image},
                          {"1/0/.zarray", array}, {"s/.zattrs", image},   {"s/0/.zarray", array}};
  ZarrValues numbered = images;
  numbered[".zattrs"] = R"({"bioformats2raw.layout": 3})";
  writeZarr(folder / "numbered", numbered);
  EXPECT_THAT(pathsOf("numbered"), ElementsAre("0", "1"));
  numbered["OME/.zattrs"] = R"({"series": ["s", "0"]})";
  writeZarr(folder / "listed", numbered);
  EXPECT_THAT(pathsOf("listed"), ElementsAre("s", "0"));
  ZarrValues plain = images;
  plain[".zgroup"] = kGroup2;
  plain["deep/.zgroup"] = kGroup2;
  plain["deep/array/.zarray"] = array;
  writeZarr(folder / "plain", plain);
  EXPECT_THAT(pathsOf("plain"), ElementsAre("0", "1", "deep/array", "s"));
}

TEST(NgffFolders, PlainArraysHaveAxesByNameOrByPlace) {
  const TempDir folder;
  const auto describe = [&](const ZarrShape& shape, const json& names = nullptr,
                            FourthAxis fourthAxis = FourthAxis::automatic) {
    ZarrValues values{{".zarray", array2(shape, shape, "|u1").dump()}, {".zattrs", "{}"}};
    if (!names.is_null()) values[".zattrs"] = json{{"_ARRAY_DIMENSIONS", names}}.dump();
    const auto file = openFile(writeZarr(folder / "a", values), {.fourthAxis = fourthAxis});
    const VolumeInfo& volume = file->volumes[0];
    return description(volume, 0) + ", " + std::to_string(volume.times.count) + " times";
  };
  EXPECT_EQ(describe({6}), "6x1x1 uint8, 1 times");
  EXPECT_EQ(describe({5, 6}), "6x5x1 uint8, 1 times");
  EXPECT_EQ(describe({4, 5, 6}), "6x5x4 uint8, 1 times");
  EXPECT_EQ(describe({2, 4, 5, 6}), "6x5x4 uint8, 2 times");
  EXPECT_EQ(describe({3, 4, 5, 6}), "6x5x4 uint8, 3 channels, 1 times");
  EXPECT_EQ(describe({3, 4, 5, 6}, nullptr, FourthAxis::time), "6x5x4 uint8, 3 times");
  EXPECT_EQ(describe({2, 4, 5, 6}, nullptr, FourthAxis::channel), "6x5x4 uint8, 2 channels, 1 times");
  EXPECT_EQ(describe({2, 3, 4, 5, 6}), "6x5x4 uint8, 3 channels, 2 times");
  EXPECT_EQ(describe({1, 2, 3, 4, 5, 6}), "6x5x4 uint8, 3 channels, 2 times");
  EXPECT_EQ(describe({4, 5, 6}, {"x", "y", "z"}), "4x5x6 uint8, 1 times");
  EXPECT_EQ(describe({4, 5, 6}, {"x", "time", "y"}), "4x6x1 uint8, 5 times");
  EXPECT_EQ(describe({4, 5, 6}, {"lat", "lon", "q"}), "6x5x4 uint8, 1 times");
  EXPECT_THAT(errorOf([&] { describe({2, 1, 1, 1, 1, 1}); }), HasSubstr("found \"\" of 2"));
}

}  // namespace
}  // namespace scolopax::io
