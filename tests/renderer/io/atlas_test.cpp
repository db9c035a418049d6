// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kCell = "multichannel/aics12_881/AICS-12_881_atlas.json";

/// A picture of these samples, row by row from the top.
template <class T>
std::filesystem::path writePng(const std::filesystem::path& path, int width, int height, int samples,
                               const std::vector<T>& values) {
  OIIO::ImageSpec spec(width, height, samples, OIIO::TypeDesc(OIIO::BaseTypeFromC<T>::value));
  spec.attribute("oiio:UnassociatedAlpha", 1);
  const auto output = OIIO::ImageOutput::create("png");
  EXPECT_TRUE(output->open(path.string(), spec) && output->write_image(spec.format, values.data()) &&
              output->close());
  return path;
}

/// Two channels of 2 x 1 x 3 voxels in two columns: slices 0, 1 in the upper row, 2 in the lower one.
const std::string kAtlas = R"({"width": 8, "height": 3, "tile_width": 2, "tile_height": 1, "tiles": 3,
  "rows": 2, "cols": 2, "channels": 2, "channel_names": ["first", "second"],
  "channel_colors": [[255, 128, 0], [0, 0, 300]],
  "pixel_size_x": 0.5, "pixel_size_y": 2, "pixel_size_z": 3,
  "images": [{"name": "a.png", "channels": [1, 0]}]})";
const std::vector<std::uint8_t> kPixels{1, 101, 0, 2, 102, 0, 3, 103, 0, 4, 104, 0,
                                        5, 105, 0, 6, 106, 0, 9, 9,   9, 9, 9,   9};

LoadedFile loadAtlas(const TempDir& folder, const std::string& json, const Warn& warn = {}) {
  return loadFile(writeBytes(folder / "a.json", json), kTestLimit, warn);
}
std::string atlasWith(const std::string& from, const std::string& to) {
  std::string json = kAtlas;
  json.replace(json.find(from), from.size(), to);
  return json;
}

TEST(AtlasFiles, TheCellIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile(kCell));
  std::vector<std::string> warnings;
  const LoadedFile file =
      loadFile(dataFile(kCell), kTestLimit, [&](const std::string& line) { warnings.push_back(line); });
  EXPECT_EQ(file.grid.dims, glm::ivec3(341, 204, 57));
  EXPECT_NEAR(file.grid.spacing().x, 0.293, 0.001);
  EXPECT_NEAR(file.grid.spacing().y, 0.331, 0.001);
  EXPECT_NEAR(file.grid.spacing().z, 0.29, 1e-12);
  EXPECT_EQ(file.worldUnit, "um");
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("images: names \"AICS-12_881_atlas_0.png\", which is not in")));
  // Sums and voxels by Python, which unpacked the pictures with zlib alone.
  struct Row {
    const char* name;
    double sum, low, high, middle, other;
  };
  const std::vector<Row> rows{
      {"Bright_100", 595195461, 40, 254, 145, 152}, {"SEG_STRUCT", 18772644, 0, 255, 0, 0},
      {"SEG_Memb", 52360613, 0, 255, 117, 0},       {"SEG_DNA", 19590051, 0, 255, 0, 0},
      {"CON_Memb", 2431883, 0, 255, 0, 0},          {"CON_DNA", 1093189, 0, 254, 0, 0}};
  ASSERT_EQ(file.channels.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(rows[i].name);
    EXPECT_EQ(file.channels[i].name, rows[i].name);
    EXPECT_EQ(file.channels[i].voxels.type(), ScalarType::u8);
    EXPECT_EQ(rangeOf(file.channels[i]), std::pair(rows[i].low, rows[i].high));
    const auto values = valuesOf(file.channels[i]);
    EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0.0), rows[i].sum);
    EXPECT_EQ(values[(29 * 204 + 100) * 341 + 170], rows[i].middle);
    EXPECT_EQ(values[(40 * 204 + 60) * 341 + 200], rows[i].other);
  }
}

TEST(AtlasFiles, TilesBecomeSlicesAndColoursChannels) {
  const TempDir folder;
  writePng(folder / "a.png", 4, 2, 3, kPixels);
  const LoadedFile file = loadAtlas(folder, kAtlas);
  EXPECT_EQ(file.grid.dims, glm::ivec3(2, 1, 3));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(2, 6, 3)) << "of 8 x 3 pixels before they were scaled down";
  ASSERT_EQ(file.channels.size(), 2u);
  EXPECT_EQ(file.channels[0].name, "first");
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(101, 102, 103, 104, 105, 106));
  EXPECT_THAT(valuesOf(file.channels[1]), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(file.channels[0].look.color, (std::array<std::uint8_t, 3>{255, 128, 0}));
  EXPECT_FALSE(file.channels[1].look.color) << "300 is no colour";
  const auto opened = openFile(folder / "a.json");
  EXPECT_THAT(opened->dataFiles, ElementsAre(folder / "a.png"));
  const LoadedPart part = load(*opened, Part{.channels = {1}}, LoadOptions{.memoryLimitBytes = kTestLimit});
  EXPECT_THAT(valuesOf(part.channels.at(0)), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(AtlasFiles, AlphaIsAChannelAndPicturesMayHave16BitsOrOneSample) {
  const TempDir folder;
  const std::string json =
      R"({"tile_width": 2, "tile_height": 1, "tiles": 1, "rows": 1, "cols": 1, "channels": 5,
    "images": [{"name": "rgba.png", "channels": [0, 1, 2, 3]}, {"name": "grey.png", "channels": [4]}],
    "pixel_size_unit": "nm"})";
  writePng<std::uint8_t>(folder / "rgba.png", 2, 1, 4, {10, 20, 30, 0, 40, 50, 60, 128});
  writePng<std::uint16_t>(folder / "grey.png", 2, 1, 1, {1000, 65535});
  const LoadedFile file = loadAtlas(folder, json);
  ASSERT_EQ(file.channels.size(), 5u);
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(10, 40)) << "not multiplied with alpha";
  EXPECT_THAT(valuesOf(file.channels[3]), ElementsAre(0, 128));
  EXPECT_EQ(file.channels[4].voxels.type(), ScalarType::u16);
  EXPECT_THAT(valuesOf(file.channels[4]), ElementsAre(1000, 65535));
  EXPECT_EQ(file.channels[4].name, "a 4");
  EXPECT_EQ(file.worldUnit, "nm");
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(1));
}

TEST(AtlasFiles, BadJsonNamesTheFieldThatIsWrong) {
  const TempDir folder;
  writePng(folder / "a.png", 4, 2, 3, kPixels);
  const auto with = [&](const std::string& from, const std::string& to) {
    return errorOf([&] { loadAtlas(folder, atlasWith(from, to)); });
  };
  for (const char* value : {"0", "-1", "2.5", "\"2\"", "1e300", "null"})
    EXPECT_THAT(with("\"tile_width\": 2", std::string("\"tile_width\": ") + value),
                HasSubstr("a.json: tile_width: expected a whole number from 1 to 2^24"))
        << value;
  EXPECT_THAT(with("\"tile_height\": 1", "\"tile_height\": 2"),
              HasSubstr("a.png: expected at least 4x4 pixels for the tiles, found 4x2"));
  EXPECT_THAT(with("\"tiles\": 3", "\"tiles\": 5"), HasSubstr("rows, cols: expected places for as many"));
  EXPECT_THAT(with("\"cols\": 2", "\"c\": 2"), HasSubstr("cols: expected a whole number"));
  EXPECT_THAT(with("\"channels\": 2", "\"channels\": 5000"), HasSubstr("channels: expected at most 4096"));
  EXPECT_THAT(with("\"channels\": 2", "\"channels\": 1"), HasSubstr("images: expected channels from 0 to 0"));
  EXPECT_THAT(with("[1, 0]", "[1, 1]"), HasSubstr("images: expected every channel once"));
  EXPECT_THAT(with("[1, 0]", "[1, -1]"), HasSubstr("images: expected channels from 0 to 1"));
  EXPECT_THAT(with("[1, 0]", "7"), HasSubstr("images: expected objects of a name and channels"));
  EXPECT_THAT(with("[{\"name\": \"a.png\", \"channels\": [1, 0]}]", "{}"),
              HasSubstr("images: expected a list"));
  EXPECT_THAT(with("0.5", "0"), HasSubstr("pixel_size_x: expected a number above 0"));
  EXPECT_THAT(with("a.png", "../a.png"),
              HasSubstr("images: expected a file in or below the header's folder"));
  EXPECT_THAT(with("a.png", "gone.png"), HasSubstr("images: expected a picture that exists, found none"));
  EXPECT_THAT(with("a.png", "a.json"), HasSubstr("a.json: expected PNG, found \"{"));
  EXPECT_THAT(errorOf([&] { loadAtlas(folder, kAtlas.substr(0, kAtlas.size() - 1)); }),
              HasSubstr("a.json: expected an object of JSON, found none"));
  // What is nested deeply must not take all the stack.
  const std::string deep = std::string(1 << 20, '[') + std::string(1 << 20, ']');
  EXPECT_EQ(with("\"first\"", deep), "");
}

TEST(AtlasFiles, PicturesThatLackASampleAreRefused) {
  const TempDir folder;
  writePng<std::uint8_t>(folder / "a.png", 4, 2, 1, std::vector<std::uint8_t>(8, 1));
  EXPECT_THAT(errorOf([&] { loadAtlas(folder, kAtlas); }),
              HasSubstr("a.png: expected a sample for each channel that images gives it, found 1"));
}

TEST(AtlasFiles, EveryTruncationOfThePictureIsAnErrorAndSoIsDamage) {
  const TempDir folder;
  writePng(folder / "whole.png", 4, 2, 3, kPixels);
  std::ifstream stream(folder / "whole.png", std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  const auto errorFor = [&](const std::string& picture) {
    writeBytes(folder / "a.png", picture);
    return errorOf([&] { loadAtlas(folder, kAtlas); });
  };
  EXPECT_EQ(errorFor(whole), "");
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(errorFor(whole.substr(0, length)), "");
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = char(damaged[i] ^ 0x10);
    EXPECT_NE(errorFor(damaged), "") << i;
  }
}

TEST(AtlasFiles, PicturesThatLieAboutTheirSizeAreRefused) {
  const TempDir folder;
  // A header of 60000 x 60000 grey pixels with its true checksum, and a few bytes of data.
  std::string header("IHDR\0\0\xEA\x60\0\0\xEA\x60\x08\0\0\0\0", 17);
  const auto chunk = [](const std::string& typeAndData) {
    const auto number = [](std::uint64_t value) {
      return std::string{char(value >> 24), char(value >> 16), char(value >> 8), char(value)};
    };
    const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(typeAndData.data()), uInt(typeAndData.size()));
    return number(typeAndData.size() - 4) + typeAndData + number(sum);
  };
  writeBytes(folder / "a.png", "\x89PNG\r\n\x1A\n" + chunk(header) + chunk("IDATdata") + chunk("IEND"));
  EXPECT_THAT(errorOf([&] { loadAtlas(folder, kAtlas); }),
              HasSubstr("a.png: 60000x60000 pixels need more than the file's"));
}

}  // namespace
}  // namespace scolopax::io
