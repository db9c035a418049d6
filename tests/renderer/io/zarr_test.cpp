// SPDX-License-Identifier: Apache-2.0
// OME-Zarr and Zarr version 2: the collection, whose sums were computed by a separate decoder, and
// hierarchies made here.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

namespace scolopax::io {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const LoadOptions kZarrLoad{.memoryLimitBytes = kTestLimit};

TEST(ZarrFiles, AnOldImageWithoutAxesOrScalesLoads) {
  const auto path = dataFile("multichannel/idr0062_6001240.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 1u);
  const VolumeInfo& volume = file->volumes[0];
  EXPECT_EQ(volume.path, "");
  EXPECT_EQ(volume.times.count, 1u);
  ASSERT_EQ(volume.levels.size(), 2u);
  EXPECT_EQ(volume.levels[0].dims, glm::ivec3(135, 137, 236));
  EXPECT_EQ(volume.levels[1].dims, glm::ivec3(67, 68, 236));
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(1));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(2, 2, 1));
  EXPECT_EQ(glm::dvec3(volume.levels[1].worldFromVoxel[3]), glm::dvec3(0.5, 0.5, 0));
  ASSERT_EQ(volume.channels.size(), 2u);
  EXPECT_EQ(volume.channels[0].name, "LaminB1");
  EXPECT_EQ(volume.channels[1].name, "Dapi");
  EXPECT_EQ(volume.channels[0].type, StoredType::u16);
  EXPECT_EQ(volume.channels[0].look.color, (std::array<std::uint8_t, 3>{0, 0, 255}));
  EXPECT_EQ(volume.channels[1].look.color, (std::array<std::uint8_t, 3>{255, 255, 0}));
  ASSERT_TRUE(volume.channels[1].look.window);
  EXPECT_EQ(volume.channels[1].look.window->lo, 0);
  EXPECT_EQ(volume.channels[1].look.window->hi, 1500);

  const LoadedPart fine = load(*file, {}, kZarrLoad);
  EXPECT_EQ(rangeOf(fine.channels[0]), std::pair(4.0, 4095.0));
  EXPECT_EQ(rangeOf(fine.channels[1]), std::pair(24.0, 2166.0));
  EXPECT_EQ(sumOf(fine.channels[0]), 287535332);
  EXPECT_EQ(sumOf(fine.channels[1]), 390501708);
  const LoadedPart coarse = load(*file, {.level = 1, .channels = {1}}, kZarrLoad);
  ASSERT_EQ(coarse.channels.size(), 1u);
  EXPECT_EQ(sumOf(coarse.channels[0]), 97117174);
  EXPECT_EQ(valuesOf(coarse.channels[0]).back(), 45);
}

TEST(ZarrFiles, ChannelsBeforeSpaceAndSlashesBetweenIndicesLoad) {
  const auto path = dataFile("formats/ome_zarr_v2/fiji_xyzc_v04.ome.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 1u);
  ASSERT_EQ(file->volumes[0].levels.size(), 2u);
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(64, 64, 16));
  EXPECT_EQ(file->volumes[0].levels[1].dims, glm::ivec3(32, 32, 8));
  EXPECT_EQ(file->volumes[0].levels[1].spacing(), glm::dvec3(2));
  EXPECT_EQ(file->volumes[0].worldUnit, "");
  ASSERT_EQ(file->volumes[0].channels.size(), 3u);
  EXPECT_FALSE(file->volumes[0].channels[0].look.color);
  const LoadedPart fine = load(*file, {}, kZarrLoad);
  EXPECT_EQ(sumOf(fine.channels[0]), 8159554);
  EXPECT_EQ(sumOf(fine.channels[1]), 11436354);
  EXPECT_EQ(sumOf(fine.channels[2]), 12668738);
  EXPECT_EQ(rangeOf(fine.channels[2]), std::pair(0.0, 255.0));
  const LoadedPart coarse = load(*file, {.level = 1, .channels = {0, 2}}, kZarrLoad);
  EXPECT_EQ(sumOf(coarse.channels[0]), 999793);
  EXPECT_EQ(sumOf(coarse.channels[1]), 1602417);
}

TEST(ZarrFiles, LabelsAreVolumesBesideTheirImage) {
  const auto path = dataFile("formats/ome_zarr_v2/zarrjava_v04_labels.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 2u);
  const VolumeInfo &image = file->volumes[0], &labels = file->volumes[1];
  EXPECT_EQ(image.levels[0].dims, glm::ivec3(16, 16, 8));
  EXPECT_EQ(image.levels[0].spacing(), glm::dvec3(0.5));
  EXPECT_EQ(image.levels[1].spacing(), glm::dvec3(1));
  EXPECT_EQ(image.worldUnit, "um");
  EXPECT_EQ(image.channels[0].name, "DAPI");
  EXPECT_EQ(image.channels[1].look.color, (std::array<std::uint8_t, 3>{0, 255, 0}));
  EXPECT_FALSE(image.channels[0].look.labels);
  EXPECT_EQ(labels.path, "labels/nuclei");
  EXPECT_EQ(labels.levels[0].dims, glm::ivec3(16, 16, 8));
  EXPECT_EQ(labels.channels[0].type, StoredType::u32);
  EXPECT_TRUE(labels.channels[0].look.labels);

  const LoadedPart voxels = load(*file, {}, kZarrLoad);
  EXPECT_NEAR(sumOf(voxels.channels[0]), 993.3319333791733, 1e-6);
  EXPECT_NEAR(sumOf(voxels.channels[1]), 1031.6790266036987, 1e-6);
  EXPECT_EQ(valuesOf(voxels.channels[1]).back(), double(0.506148099899292f));
  EXPECT_NEAR(sumOf(load(*file, {.level = 1}, kZarrLoad).channels[1]), 129.97258681058884, 1e-6);
  const LoadedPart nuclei = load(*file, {.volume = 1}, kZarrLoad);
  EXPECT_EQ(rangeOf(nuclei.channels[0]), std::pair(0.0, 2.0));
  EXPECT_EQ(sumOf(nuclei.channels[0]), 2008);
}

TEST(ZarrFiles, ImagesOfBioformats2rawAreFound) {
  const auto path = dataFile("formats/ome_zarr_v2/mitotic_plate.ome.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 1u);
  const VolumeInfo& volume = file->volumes[0];
  EXPECT_EQ(volume.levels[0].dims, glm::ivec3(263, 263, 6));
  EXPECT_EQ(volume.levels[1].dims, glm::ivec3(131, 131, 6));
  EXPECT_NEAR(volume.levels[0].spacing().x, 0.0852, 5e-5);
  EXPECT_EQ(volume.levels[0].spacing().z, 3);
  EXPECT_EQ(volume.worldUnit, "um");
  EXPECT_EQ(volume.channels[0].name, "Channel 0");
  EXPECT_FALSE(volume.channels[0].look.color) << "the model is greyscale";
  EXPECT_EQ(volume.channels[0].look.window->hi, 162);
  const LoadedPart fine = load(*file, {}, kZarrLoad);
  EXPECT_EQ(rangeOf(fine.channels[0]), std::pair(3.0, 162.0));
  EXPECT_EQ(sumOf(fine.channels[0]), 4380918);
  EXPECT_EQ(sumOf(load(*file, {.level = 1}, kZarrLoad).channels[0]), 1092179);
}

TEST(ZarrFiles, ValidExamplesLoadAndInvalidOnesAreRefused) {
  const auto folder = dataFile("formats/ome_zarr_examples");
  SKIP_WITHOUT(folder);
  const auto open = [&](const char* name) { return openFile(folder / name); };
  const auto picture = open("valid/image-01.zarr");
  EXPECT_EQ(picture->volumes[0].levels[0].dims, glm::ivec3(1000, 1000, 1));
  EXPECT_EQ(picture->volumes[0].worldUnit, "um");
  EXPECT_EQ(rangeOf(load(*picture, {}, kZarrLoad).channels[0]), std::pair(0.0, 0.0)) << "no chunks";
  EXPECT_EQ(open("valid/image-02.zarr")->volumes[0].levels[0].dims, glm::ivec3(200, 200, 1));
  EXPECT_EQ(open("valid/image-03.zarr")->volumes[0].levels[0].dims, glm::ivec3(100, 100, 2));
  const auto levels = open("valid/image-04.zarr");
  EXPECT_EQ(levels->volumes[0].levels[1].dims, glm::ivec3(32, 32, 2));
  EXPECT_EQ(levels->volumes[0].levels[1].spacing(), glm::dvec3(2, 2, 1));
  const auto plate = open("valid/plate-01.zarr");
  ASSERT_EQ(plate->volumes.size(), 4u);
  EXPECT_EQ(plate->volumes[1].path, "A/2/0");
  EXPECT_EQ(plate->volumes[1].levels[0].dims, glm::ivec3(1000, 1000, 1));

  const auto refusal = [&](const char* name) { return errorOf([&] { open(name); }); };
  EXPECT_THAT(refusal("invalid/image-01.zarr"), HasSubstr("expected a volume, found none"));
  EXPECT_THAT(refusal("invalid/image-02.zarr"),
              HasSubstr("image-02.zarr/.zattrs: multiscales: expected an image"));
  EXPECT_THAT(refusal("invalid/image-03.zarr"),
              HasSubstr("multiscales[0]: datasets: expected an array \"0\", found none"));
  EXPECT_THAT(refusal("invalid/image-04.zarr"), HasSubstr("/1: shape: expected 3 axes"));
  std::vector<std::string> warnings;
  const auto mixed = openFile(folder / "warning/image-01.zarr",
                              {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  EXPECT_EQ(mixed->volumes[0].levels.size(), 1u) << "the other level has another type";
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("/1: expected the type")));
}

TEST(ZarrFiles, OrdersSeparatorsAndByteOrdersOfVersion2Load) {
  const TempDir folder;
  const ZarrShape shape{3, 4, 5};
  int number = 0;
  for (const ZarrShape& chunk : {ZarrShape{3, 4, 5}, {2, 3, 4}, {1, 4, 2}, {4, 7, 9}})
    for (const bool fortran : {false, true})
      for (const char separator : {'.', '/'})
        for (const bool big : {false, true}) {
          auto document = array2(shape, chunk, big ? ">i2" : "<i2");
          if (fortran) document["order"] = "F";
          if (separator == '/') document["dimension_separator"] = "/";
          ZarrValues values{{".zarray", document.dump()}};
          const std::vector<std::size_t> order =
              fortran ? std::vector<std::size_t>{2, 1, 0} : std::vector<std::size_t>{0, 1, 2};
          addChunks(values, shape, chunk, "", separator, [&](const ZarrShape& first) {
            return rampChunk<std::int16_t>(shape, chunk, first, order, big);
          });
          const auto path = writeZarr(folder / std::to_string(number++), values);
          const auto file = openFile(path);
          EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(5, 4, 3));
          EXPECT_EQ(zarrValues(path), rampUpTo(60)) << document;
        }
}

TEST(ZarrFiles, EveryTypeOfVersion2LoadsOrIsRefused) {
  const TempDir folder;
  const auto write = [&](const std::string& dtype, const std::string& bytes) {
    return writeZarr(folder / "a.zarr",
                     {{".zarray", array2({1, 1, 2}, {1, 1, 2}, dtype).dump()}, {"0.0.0", bytes}});
  };
  const std::vector<double> expected{1, 100};
  EXPECT_EQ(zarrValues(write("|i1", bytesOf<std::int8_t>({1, 100}))), expected);
  EXPECT_EQ(zarrValues(write("|u1", bytesOf<std::uint8_t>({1, 100}))), expected);
  EXPECT_EQ(zarrValues(write("|b1", bytesOf<std::uint8_t>({1, 0}))), (std::vector<double>{1, 0}));
  EXPECT_EQ(zarrValues(write("<u2", bytesOf<std::uint16_t>({1, 100}))), expected);
  EXPECT_EQ(zarrValues(write(">u2", bytesOf<std::uint16_t>({1, 100}, true))), expected);
  EXPECT_EQ(zarrValues(write("<i4", bytesOf<std::int32_t>({1, 100}))), expected);
  EXPECT_EQ(zarrValues(write(">u4", bytesOf<std::uint32_t>({1, 100}, true))), expected);
  EXPECT_EQ(zarrValues(write("<i8", bytesOf<std::int64_t>({1, 100}))), expected);
  EXPECT_EQ(zarrValues(write(">u8", bytesOf<std::uint64_t>({1, 100}, true))), expected);
  EXPECT_EQ(zarrValues(write("<f2", bytesOf<std::uint16_t>({0x3C00, 0x5640}))), expected);
  EXPECT_EQ(zarrValues(write(">f4", bytesOf<float>({1, 100}, true))), expected);
  EXPECT_EQ(zarrValues(write("<f8", bytesOf<double>({1, 100}))), expected);
  for (const char* dtype : {"<c8", "|S3", "<U2", "<M8[ns]", "|V4", "<f3", "u2", "|O", "", "<i1000000001"})
    EXPECT_THAT(loadError(write(dtype, "")), HasSubstr(".zarray: dtype: expected a type of one number"))
        << dtype;
  auto record = array2({1}, {1}, "");
  record["dtype"] = nlohmann::json::array({nlohmann::json::array({"r", "|u1"})});
  EXPECT_THAT(loadError(writeZarr(folder / "b.zarr", {{".zarray", record.dump()}})),
              HasSubstr("dtype: expected a type of one number, such as \"<u2\", found a list of 1"));
}

TEST(ZarrFiles, MissingChunksHaveTheFillValue) {
  const TempDir folder;
  const auto valueOf = [&](const std::string& dtype, const nlohmann::json& fill) {
    auto document = array2({1, 1, 4}, {1, 1, 2}, dtype);
    document["fill_value"] = fill;
    return zarrValues(writeZarr(folder / "a.zarr", {{".zarray", document.dump()}})).back();
  };
  EXPECT_EQ(valueOf("<u2", 7), 7);
  EXPECT_EQ(valueOf(">u2", 258), 258);
  EXPECT_EQ(valueOf("<u2", nullptr), 0);
  EXPECT_EQ(valueOf("<u2", 7.0), 7);
  EXPECT_EQ(valueOf("|b1", true), 1);
  EXPECT_EQ(valueOf("<i2", -5), -5);
  EXPECT_EQ(valueOf("<u4", 4294967295u), 4294967295.0f);
  EXPECT_EQ(valueOf("<i8", -3), -3);
  EXPECT_EQ(valueOf(">f4", 0.5), 0.5);
  EXPECT_EQ(valueOf("<f8", -2.5), -2.5);
  EXPECT_TRUE(std::isnan(valueOf("<f4", "NaN")));
  EXPECT_EQ(valueOf("<f4", "-Infinity"), -std::numeric_limits<double>::infinity());
  for (const double half : {0.0, -1.0, 0.5, 65504.0, 6.103515625e-05, 5.9604644775390625e-08, 1000.0})
    EXPECT_EQ(valueOf("<f2", half), half);
  const auto errorFor = [&](const std::string& dtype, const nlohmann::json& fill) {
    return errorOf([&] { valueOf(dtype, fill); });
  };
  EXPECT_THAT(errorFor("|u1", 256),
              HasSubstr("fill_value: expected a whole number of the array's type, found 256"));
  EXPECT_THAT(errorFor("|u1", -1), HasSubstr("fill_value"));
  EXPECT_THAT(errorFor("<i2", 0.5), HasSubstr("fill_value"));
  EXPECT_THAT(errorFor("<i8", 1e30), HasSubstr("fill_value"));
  EXPECT_THAT(errorFor("<f4", "none"), HasSubstr("fill_value: expected a number"));

  valueOf("<u2", 7);
  std::vector<std::string> warnings;
  loadFile(folder / "a.zarr", kTestLimit, [&](const std::string& line) { warnings.push_back(line); });
  EXPECT_THAT(warnings, Contains(HasSubstr("no chunk is there")));
  auto document = array2({2, 1, 3}, {1, 1, 2}, "<u2");
  document["fill_value"] = 9;
  const auto path = writeZarr(folder / "b.zarr",
                              {{".zarray", document.dump()}, {"1.0.1", bytesOf<std::uint16_t>({5, 77})}});
  EXPECT_EQ(zarrValues(path), (std::vector<double>{9, 9, 9, 9, 9, 5}));
}

TEST(ZarrFiles, AxesAreFoundByTheirNamesInAnyOrder) {
  const TempDir folder;
  const auto load = [&](const std::string& axes, const ZarrShape& shape, const Part& part) {
    ZarrValues values{{".zattrs", multiscales(axes, {std::vector<double>(axes.size(), 2.0)}).dump()},
                      {"0/.zarray", array2(shape, shape, "<i2").dump()}};
    addChunks(values, shape, shape, "0/", '.',
              [&](const ZarrShape& first) { return rampChunk<std::int16_t>(shape, shape, first); });
    const auto path = writeZarr(folder / axes, values);
    return std::pair(openFile(path)->volumes[0], zarrValues(path, part));
  };
  const auto [xyz, transposed] = load("xyz", {3, 2, 1}, {});
  EXPECT_EQ(xyz.levels[0].dims, glm::ivec3(3, 2, 1));
  EXPECT_EQ(transposed, (std::vector<double>{0, 2, 4, 1, 3, 5}));
  const auto [yx, picture] = load("yx", {2, 3}, {});
  EXPECT_EQ(yx.levels[0].dims, glm::ivec3(3, 2, 1));
  EXPECT_EQ(yx.levels[0].spacing(), glm::dvec3(2));
  const auto [yxct, second] = load("yxct", {1, 2, 3, 4}, {.time = 2, .channels = {1}});
  EXPECT_EQ(yxct.times.count, 4u);
  EXPECT_EQ(yxct.channels.size(), 3u);
  EXPECT_EQ(second, (std::vector<double>{6, 18})) << "x * 12 + channel * 4 + time";
  const auto [tczyx, fifth] = load("tczyx", {2, 2, 1, 2, 2}, {.time = 1, .channels = {1}});
  EXPECT_EQ(fifth, (std::vector<double>{12, 13, 14, 15}));
}

TEST(ZarrFiles, OnlyTheChunksOfAPartAreRead) {
  const TempDir folder;
  const ZarrShape shape{2, 4, 1, 1, 2}, chunk{1, 2, 1, 1, 2};
  ZarrValues values{{".zattrs", multiscales("tczyx", {{1, 1, 1, 1, 1}}).dump()},
                    {"0/.zarray", array2(shape, chunk, "|u1").dump()}};
  addChunks(values, shape, chunk, "0/", '.', [&](const ZarrShape& first) {
    return first[0] == 1 && first[1] == 2 ? rampChunk<std::uint8_t>(shape, chunk, first) : "bad";
  });
  const auto path = writeZarr(folder / "a.zarr", values);
  EXPECT_EQ(zarrValues(path, {.time = 1, .channels = {3}}), (std::vector<double>{14, 15}));
  EXPECT_THAT(errorOf([&] { zarrValues(path, {.time = 1, .channels = {1}}); }),
              HasSubstr("a.zarr/0/1.0.0.0.0: expected a chunk of 4 bytes, found 3"));
}

}  // namespace
}  // namespace scolopax::io
