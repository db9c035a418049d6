// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include "tests/renderer/io/tiff_test_support.h"

namespace scolopax::io {
namespace {

using testing::HasSubstr;

/// Pages of 6 pixels each, numbered consecutively across pages.
std::vector<std::string> countingPages(int count, bool reversed = false) {
  std::vector<std::string> pages;
  for (int p = 0; p < count; ++p) {
    std::vector<std::uint16_t> page(6);
    for (int i = 0; i < 6; ++i) page[std::size_t(i)] = std::uint16_t(p * 6 + i);
    pages.push_back(bytesOf(page, reversed));
  }
  return pages;
}
std::vector<double> counting(int first, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(first + i);
  return values;
}
LoadedFile loadTiff(const TempDir& folder, const std::string& bytes, std::string* warnings = nullptr) {
  return loadFile(writeBytes(folder / "a.tif", bytes), kTestLimit, [&](const std::string& text) {
    if (warnings) *warnings += text + "\n";
  });
}

TEST(TiffFiles, HaveTheValuesThatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("multichannel/tiff"));
  struct Row {
    const char* name;
    glm::ivec3 dims;
    std::size_t channels;
    double low, high;
    glm::dvec3 spacing;
  };
  for (const Row& row :
       {Row{"multichannel/tiff/xyzc_16bit__dna_conf_wf.tif",
            {133, 130, 45},
            2,
            0,
            61711,
            {0.512, 0.512, 0.499}},
        Row{"multichannel/tiff/xyzc_16bit__spots.tif", {89, 88, 17}, 2, 208, 54004, {0.0941, 0.0941, 0.4}},
        Row{"labels/nuclei_stardist/img3d.tif", {57, 61, 31}, 1, 104, 375, glm::dvec3(1)},
        Row{"labels/nuclei_stardist/mask3d.tif", {57, 61, 31}, 1, 0, 162, glm::dvec3(1)}}) {
    SCOPED_TRACE(row.name);
    const LoadedFile file = loadFile(dataFile(row.name), kTestLimit, {});
    EXPECT_EQ(file.grid.dims, row.dims);
    ASSERT_EQ(file.channels.size(), row.channels);
    double low = INFINITY, high = -INFINITY;
    for (const ChannelSource& channel : file.channels) {
      EXPECT_EQ(channel.voxels.type(), ScalarType::u16);
      const auto range = rangeOf(channel);
      low = std::min(low, range.first), high = std::max(high, range.second);
    }
    EXPECT_EQ(low, row.low);
    EXPECT_EQ(high, row.high);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(file.grid.spacing()[axis], row.spacing[axis], 5e-4);
  }
}

TEST(TiffFiles, PagesAreSlicesInEveryVariantOfTheContainer) {
  const TempDir folder;
  for (const bool bigEndian : {false, true}) {
    for (const bool bigTiff : {false, true}) {
      TiffBytes tiff;
      tiff.bigEndian = bigEndian, tiff.bigTiff = bigTiff;
      const LoadedFile file = loadTiff(folder, tiff.build(countingPages(5, bigEndian)));
      EXPECT_EQ(file.grid.dims, glm::ivec3(3, 2, 5));
      EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(1.0));
      ASSERT_EQ(file.channels.size(), 1u);
      EXPECT_EQ(file.channels[0].name, "a");
      EXPECT_EQ(valuesOf(file.channels[0]), counting(0, 30));
    }
  }
}

TEST(TiffFiles, ThousandsOfPagesComeInOrder) {
  const TempDir folder;
  const LoadedFile file = loadTiff(folder, TiffBytes().build(countingPages(8000)));
  EXPECT_EQ(file.grid.dims, glm::ivec3(3, 2, 8000));
  EXPECT_EQ(valuesOf(file.channels[0]), counting(0, 48000));
}

TEST(TiffFiles, ImageJsPagesRunOverChannelsThenSlicesThenTimes) {
  const TempDir folder;
  TiffBytes tiff;
  tiff.description =
      "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\nunit=micron\nspacing=2.5\n";
  tiff.xResolution = 4000;
  std::string warnings;
  const LoadedFile file = loadTiff(folder, tiff.build(countingPages(12)), &warnings);
  EXPECT_EQ(file.grid.dims, glm::ivec3(3, 2, 3));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(0.25, 0.25, 2.5));
  ASSERT_EQ(file.channels.size(), 2u);
  for (int c = 0; c < 2; ++c) {
    std::vector<double> expected;
    for (const int page : {c, c + 2, c + 4})
      std::ranges::copy(counting(page * 6, 6), std::back_inserter(expected));
    EXPECT_EQ(valuesOf(file.channels[std::size_t(c)]), expected);
    EXPECT_EQ(file.channels[std::size_t(c)].name, "a " + std::to_string(c));
  }
  EXPECT_EQ(warnings, "");
  EXPECT_EQ(file.worldUnit, "um");
  EXPECT_EQ(file.times.count, 2u);
  const LoadedFile second = loadFile(folder / "a.tif", kTestLimit, {}, 1);
  EXPECT_EQ(valuesOf(second.channels[1])[0], (6 + 1) * 6);
}

TEST(TiffFiles, ImageJsLargeStacksLieBehindTheirOnlyPage) {
  const TempDir folder;
  for (const bool bigEndian : {false, true}) {
    TiffBytes tiff;
    tiff.bigEndian = bigEndian;
    tiff.description = "ImageJ=1.54f\nimages=4\nslices=4\n";
    tiff.tags[279] = 12;
    std::string all;
    for (const std::string& page : countingPages(4, bigEndian)) all += page;
    EXPECT_EQ(valuesOf(loadTiff(folder, tiff.build({all})).channels[0]), counting(0, 24));
    EXPECT_THAT(loadError(writeBytes(folder / "b.tif", tiff.build({all.substr(0, 47)}))),
                HasSubstr("expected 12 bytes"));
  }
}

TEST(TiffFiles, ColoursAreThreeChannelsAndAlphaIsLeftOut) {
  const TempDir folder;
  for (const int samples : {3, 4}) {
    OIIO::ImageSpec spec(4, 3, samples, OIIO::TypeUInt8);
    spec.attribute("compression", "lzw");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    std::vector<std::uint8_t> pixels(std::size_t(12 * samples));
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = std::uint8_t(i * 5);
    const auto path = folder / "a.tif";
    const auto output = OIIO::ImageOutput::create(path.string());
    ASSERT_TRUE(output->open(path.string(), spec) && output->write_image(OIIO::TypeUInt8, pixels.data()) &&
                output->close());
    const LoadedFile file = loadFile(path, kTestLimit, {});
    ASSERT_EQ(file.channels.size(), 3u);
    EXPECT_EQ(file.channels[1].name, "a green");
    for (std::size_t i = 0; i < 12; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(valuesOf(file.channels[c])[i], pixels[i * std::size_t(samples) + c]) << "not premultiplied";
      }
    }
  }
}

TEST(TiffFiles, NumbersAreThoseStoredWhateverTheDisplayWas) {
  const TempDir folder;
  for (const std::uint64_t photometric : {0u, 3u}) {
    TiffBytes tiff;
    tiff.tags[262] = photometric;
    EXPECT_EQ(valuesOf(loadTiff(folder, tiff.build(countingPages(2))).channels[0]), counting(0, 12))
        << photometric;
  }
}

TEST(TiffFiles, HostileFilesAreRefusedBeforeMemoryIsTaken) {
  const TempDir folder;
  const auto pages = countingPages(3);
  const auto errorOfTags = [&](std::map<int, std::uint64_t> tags) {
    TiffBytes tiff;
    tiff.tags = std::move(tags);
    return loadError(writeBytes(folder / "a.tif", tiff.build(pages)));
  };
  EXPECT_EQ(errorOfTags({}), "");
  EXPECT_NE(errorOfTags({{256, 0}}), "");
  EXPECT_NE(errorOfTags({{256, 4000000000u}, {257, 4000000000u}}), "");
  EXPECT_THAT(errorOfTags({{256, 60000}, {257, 60000}}), HasSubstr("the file holds at most"));
  EXPECT_THAT(errorOfTags({{256, 3000}, {257, 3000}}), HasSubstr("the file holds at most"));
  EXPECT_NE(errorOfTags({{273, 1000000}}), "") << "a strip beyond the file";
  EXPECT_NE(errorOfTags({{277, 60000}}), "");
  EXPECT_THAT(errorOfTags({{258, 12}}), HasSubstr("BitsPerSample: expected"));
  EXPECT_NE(errorOfTags({{259, 9999}}), "") << "an unknown compression";

  std::string loop = TiffBytes().build(pages);
  const std::size_t next = 8 + 2 + 9 * 12;
  loop.replace(next, 4, std::string("\x08\0\0\0", 4));
  EXPECT_THAT(loadError(writeBytes(folder / "loop.tif", loop)),
              HasSubstr("page 2: expected a new directory"));
  loop.replace(next, 4, std::string("\xF0\xFF\xFF\x7F", 4));
  EXPECT_THAT(loadError(writeBytes(folder / "far.tif", loop)),
              HasSubstr("page 2: expected a directory within the file"));
  EXPECT_THAT(loadError(writeBytes(folder / "none.tif", std::string("II*\0\0\0\0\0", 8))),
              HasSubstr("at least one page"));
  EXPECT_THAT(loadError(writeBytes(folder / "bad.tif", "not a picture")),
              HasSubstr("magic: expected a TIFF file"));
  EXPECT_THAT(loadError(writeBytes(folder / "empty.tif", "")), HasSubstr("magic"));
}

TEST(TiffFiles, PagesOfAnotherSizeAreRefused) {
  const TempDir folder;
  std::string bytes = TiffBytes().build(countingPages(2));
  const std::size_t second = 8 + 2 + 9 * 12 + 4 + 12;
  bytes[second + 2 + 8] = 2;  // the width of page 2
  EXPECT_THAT(loadError(writeBytes(folder / "a.tif", bytes)),
              HasSubstr("page 2: expected 3x2, 1 x uint16 as on page 1, found 2x2"));
}

TEST(TiffFiles, ImageJsCountsMustMakeUpThePages) {
  const TempDir folder;
  for (const char* counts :
       {"images=4\nchannels=2\nslices=3\n", "images=6\nchannels=2\nslices=3\n",
        "channels=1000000000\nslices=1000000000\n", "images=1\nchannels=-1\n", "images=x\n",
        "channels=99999999999999999999\n", "images=4\nchannels=4\nframes=1000000000\n"}) {
    TiffBytes tiff;
    tiff.description = "ImageJ=1.54f\n" + std::string(counts);
    EXPECT_THAT(loadError(writeBytes(folder / "a.tif", tiff.build(countingPages(4)))),
                HasSubstr("ImageDescription: "))
        << counts;
  }
}

TEST(TiffFiles, EveryTruncationIsRefused) {
  const TempDir folder;
  TiffBytes tiff;
  tiff.description = "ImageJ=1.54f\nimages=2\nslices=2\n";
  const std::string whole = tiff.build(countingPages(2));
  EXPECT_EQ(loadError(writeBytes(folder / "a.tif", whole)), "");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(loadError(writeBytes(folder / "a.tif", whole.substr(0, length))), "") << length;
  }
}

/// A picture of 64x60 deflated pixels in several strips or tiles.
std::string deflatedPicture(const TempDir& folder, int tileSize) {
  OIIO::ImageSpec spec(64, 60, 1, OIIO::TypeUInt8);
  spec.attribute("compression", "zip");
  spec.attribute("tiff:RowsPerStrip", 16);
  spec.tile_width = spec.tile_height = tileSize;
  std::vector<std::uint8_t> pixels(64 * 60);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = std::uint8_t(i * i / 7);
  const std::string path = (folder / "deflated.tif").string();
  const auto output = OIIO::ImageOutput::create(path);
  EXPECT_TRUE(output->open(path, spec) && output->write_image(OIIO::TypeUInt8, pixels.data()) &&
              output->close());
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(TiffFiles, DeflatedStripsAndTilesLoadAndDamagedOnesAreRefused) {
  const TempDir folder;
  for (const int tileSize : {0, 16}) {
    const std::string whole = deflatedPicture(folder, tileSize);
    const auto values = valuesOf(loadTiff(folder, whole).channels[0]);
    ASSERT_EQ(values.size(), 64u * 60u);
    for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(values[i], double(i * i / 7 % 256)) << i;
    // The compressed pixels are the larger part of the file, at its end.
    ASSERT_GT(whole.size(), 1000u);
    for (const std::size_t at : {whole.size() / 2, whole.size() - 300, whole.size() - 50}) {
      std::string damaged = whole;
      damaged[at] = char(damaged[at] ^ 0xFF);
      EXPECT_THAT(loadError(writeBytes(folder / "b.tif", damaged)), HasSubstr("page 1: cannot be decoded"))
          << at;
    }
  }
}

}  // namespace
}  // namespace scolopax::io
