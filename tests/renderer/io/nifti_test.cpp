// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <nifti2_io.h>

#include <array>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A NIfTI-1 header as bytes, 4x3x2 of int16 with 2 mm steps unless changed.
struct Header1 {
  std::string bytes = std::string(352, '\0');
  Header1() {
    set<std::int32_t>(0, 348);
    dim({3, 4, 3, 2, 0, 0, 0, 0});
    type(4, 16);
    pixdim({1, 2, 2, 2, 0, 0, 0, 0});
    set<float>(108, 352);
    set<std::uint8_t>(123, 2);
    bytes.replace(344, 4, "n+1\0", 4);
  }
  template <class T>
  Header1& set(std::size_t position, T value) {
    std::memcpy(bytes.data() + position, &value, sizeof value);
    return *this;
  }
  template <class T>
  Header1& setAll(std::size_t position, std::initializer_list<T> values) {
    for (const T value : values) {
      set(position, value);
      position += sizeof(T);
    }
    return *this;
  }
  Header1& dim(std::initializer_list<std::int16_t> values) { return setAll(40, values); }
  Header1& pixdim(std::initializer_list<float> values) { return setAll(76, values); }
  Header1& type(std::int16_t code, std::int16_t bits) { return set(70, code).set(72, bits); }
  Header1& magic(const char* text) {
    bytes.replace(344, 4, text, 4);
    return *this;
  }
};

std::vector<std::int16_t> ramp(std::size_t count) {
  std::vector<std::int16_t> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = std::int16_t(int(i) * 7 - 50);
  return values;
}
std::vector<double> asDoubles(const std::vector<std::int16_t>& values) {
  return {values.begin(), values.end()};
}

LoadedFile loadNifti(const TempDir& folder, const std::string& bytes, const char* name = "a.nii") {
  return loadFile(writeBytes(folder / name, bytes), kTestLimit, {});
}

TEST(NiftiFiles, HaveTheValuesThatTheCollectionStates) {
  struct Row {
    const char* name;
    glm::ivec3 dims;
    ScalarType type;
    double low, high;
    glm::dvec3 spacing;
    std::size_t channels = 1;
    const char* warning = nullptr;
  };
  const ScalarType u8 = ScalarType::u8, i16 = ScalarType::i16;
  const glm::dvec3 one(1);
  const glm::ivec3 brain(240, 240, 155), stroke(124, 160, 140), ct(122, 101, 112);
  const double unknown = std::numeric_limits<double>::quiet_NaN();  // the list states no range or spacing
  const Row rows[] = {
      {"multichannel/tcga_du_7294/TCGA-DU-7294_t1_bet.nii.gz", brain, i16, -69, 837, one},
      {"multichannel/tcga_du_7294/TCGA-DU-7294_t1c_bet.nii.gz", brain, i16, -105, 2030, one},
      {"multichannel/tcga_du_7294/TCGA-DU-7294_t2_bet.nii.gz", brain, i16, -122, 2659, one},
      {"multichannel/tcga_du_7294/TCGA-DU-7294_fla_bet.nii.gz", brain, i16, -54, 783, one},
      {"multichannel/tcga_du_7294/TCGA-DU-7294_seg_fusion_simple.nii.gz", brain, u8, 0, 2, one},
      {"multichannel/stroke_mri/T1.nii.gz", stroke, u8, 0, 252, one},
      {"multichannel/stroke_mri/T2.nii.gz", stroke, u8, 0, 504, one},
      {"multichannel/stroke_mri/FLAIR.nii.gz", stroke, u8, 0, 255, one},
      {"multichannel/stroke_mri/lesion.nii.gz", stroke, u8, 0, 3, one},
      {"scalar/bonsai.nii.gz", glm::ivec3(256), u8, unknown, unknown, one},
      {"scalar/engine.nii.gz", {256, 256, 128}, u8, unknown, unknown, one},
      {"scalar/heptane.nii.gz", glm::ivec3(302), u8, unknown, unknown, one},
      {"scalar/fuel.nii.gz", {64, 33, 32}, u8, unknown, unknown, one},
      {"labels/ct_totalsegmentator/example_ct.nii.gz", ct, i16, -1207, 3382, glm::dvec3(3), 1,
       "int32 voxels are kept as int16 (every value fits)"},
      {"labels/ct_totalsegmentator/example_seg_fast_force_split.nii.gz", ct, u8, 0, 117, glm::dvec3(3)},
      {"timeseries/example4d.nii.gz", {128, 96, 24}, i16, 0, 1162, {2, 2, 2.2}},
      {"formats/nifti/minimal.nii.gz", {64, 64, 10}, u8, unknown, unknown, glm::dvec3(unknown)},
      {"formats/nifti/low_res.nii.gz", {7, 5, 3}, u8, unknown, unknown, glm::dvec3(unknown)},
      {"formats/nifti/draw.nii.gz", {79, 67, 64}, u8, unknown, unknown, glm::dvec3(unknown)},
      {"formats/nifti/ct_perfusion.nii.gz", {256, 286, 15}, u8, unknown, unknown, glm::dvec3(unknown), 3},
      {"formats/nifti/ras.hdr", {62, 41, 34}, u8, unknown, unknown, glm::dvec3(unknown)},
      {"formats/nifti/ras.img", {62, 41, 34}, u8, unknown, unknown, glm::dvec3(unknown)},
      {"formats/nifti/example_nifti2.nii.gz", {32, 20, 12}, i16, unknown, unknown, {2, 2, 2.2}},
  };
  SKIP_WITHOUT(dataFile("formats/nifti"));
  for (const Row& row : rows) {
    SCOPED_TRACE(row.name);
    std::string warnings;
    const LoadedFile file =
        loadFile(dataFile(row.name), kTestLimit, [&](const std::string& text) { warnings += text; });
    EXPECT_EQ(file.grid.dims, row.dims);
    ASSERT_EQ(file.channels.size(), row.channels);
    for (const ChannelSource& channel : file.channels) EXPECT_EQ(channel.voxels.type(), row.type);
    if (!std::isnan(row.low)) {
      const auto [low, high] = rangeOf(file.channels[0]);
      EXPECT_NEAR(low, row.low, 0.05);
      EXPECT_NEAR(high, row.high, 0.05);
    }
    for (int axis = 0; axis < 3 && !std::isnan(row.spacing.x); ++axis) {
      EXPECT_NEAR(file.grid.spacing()[axis], row.spacing[axis], 1e-5);
    }
    if (row.warning)
      EXPECT_THAT(warnings, HasSubstr(row.warning));
    else
      EXPECT_EQ(warnings, "");
  }
}

/// Voxels and affine transform agree with the format's reference reader.
TEST(NiftiFiles, AgreeWithTheReferenceReader) {
  SKIP_WITHOUT(dataFile("formats/nifti"));
  for (const char* name :
       {"multichannel/stroke_mri/T2.nii.gz", "multichannel/tcga_du_7294/TCGA-DU-7294_t2_bet.nii.gz",
        "formats/nifti/minimal.nii.gz", "formats/nifti/low_res.nii.gz", "formats/nifti/draw.nii.gz",
        "formats/nifti/ct_perfusion.nii.gz", "formats/nifti/ras.hdr", "formats/nifti/example_nifti2.nii.gz",
        "timeseries/example4d.nii.gz", "scalar/fuel.nii.gz"}) {
    SCOPED_TRACE(name);
    const LoadedFile file = loadFile(dataFile(name), kTestLimit, {});
    nifti_image* image = nifti_image_read(dataFile(name).c_str(), 1);
    ASSERT_NE(image, nullptr);
    const auto& m = image->sform_code > 0 ? image->sto_xyz : image->qto_xyz;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        EXPECT_NEAR(file.grid.worldFromVoxel[column][row], m.m[row][column], 2e-5);
    const std::size_t channels = file.channels.size(), count = file.grid.voxelCount();
    const auto* bytes = static_cast<const std::byte*>(image->data);
    for (std::size_t c = 0; c < channels; ++c) {
      const VoxelBuffer& voxels = file.channels[c].voxels;
      const std::size_t size = voxels.sizeBytes() / count;
      std::size_t different = 0;
      for (std::size_t i = 0; i < count; ++i) {
        different += std::memcmp(voxels.data() + i * size, bytes + (i * channels + c) * size, size) != 0;
      }
      EXPECT_EQ(different, 0u);
    }
    nifti_image_free(image);
  }
}

TEST(NiftiFiles, ComplexVoxelsAreRefused) {
  SKIP_WITHOUT(dataFile("formats/nifti/complex.nii.gz"));
  EXPECT_THAT(loadError(dataFile("formats/nifti/complex.nii.gz")),
              AllOf(HasSubstr("complex.nii.gz: datatype: expected"), HasSubstr("found 32 (complex)")));
}

TEST(NiftiFiles, ThreeChannelsOfOnePatientAreOneDataSet) {
  SKIP_WITHOUT(dataFile("multichannel/stroke_mri"));
  const std::vector<std::filesystem::path> paths{
      dataFile("multichannel/stroke_mri/T1.nii.gz"), dataFile("multichannel/stroke_mri/T2.nii.gz"),
      dataFile("scalar/fuel.nii.gz"), dataFile("multichannel/stroke_mri/FLAIR.nii.gz")};
  const auto datasets = loadDatasets(paths, kTestLimit, {});
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_EQ(datasets[0].id, "t1");
  ASSERT_EQ(datasets[0].volume->channels().size(), 3u);
  EXPECT_EQ(datasets[0].volume->channels()[2].name, "FLAIR");
  EXPECT_NEAR(datasets[0].volume->channels()[1].slope, 2.00784, 1e-5);
  EXPECT_EQ(datasets[1].id, "fuel");
}

TEST(NiftiFiles, BothByteOrdersOfBothVersionsLoad) {
  const TempDir folder;
  const auto voxels = ramp(24);
  const std::string little = Header1().bytes + bytesOf(voxels);
  EXPECT_EQ(valuesOf(loadNifti(folder, little).channels[0]), asDoubles(voxels));
  EXPECT_EQ(valuesOf(loadNifti(folder, gzipped(little), "a.nii.gz").channels[0]), asDoubles(voxels));

  // The same header with every number byte-swapped: fields by their sizes.
  Header1 big;
  const auto reverse = [&](std::size_t at, std::size_t size, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      std::reverse(&big.bytes[at + i * size], &big.bytes[at + (i + 1) * size]);
  };
  reverse(0, 4, 1), reverse(40, 2, 8), reverse(70, 2, 2), reverse(76, 4, 8), reverse(108, 4, 3),
      reverse(252, 2, 2);
  const LoadedFile swapped = loadNifti(folder, big.bytes + bytesOf(voxels, true));
  EXPECT_EQ(valuesOf(swapped.channels[0]), asDoubles(voxels));
  EXPECT_EQ(swapped.grid.spacing(), glm::dvec3(2));

  for (const bool reversed : {false, true}) {
    std::string two(544, '\0');
    const auto put = [&]<class T>(std::size_t at, std::vector<T> values) {
      two.replace(at, values.size() * sizeof(T), bytesOf(values, reversed));
    };
    put(0, std::vector<std::int32_t>{540});
    two.replace(4, 8, "n+2\0\r\n\032\n", 8);
    put(12, std::vector<std::int16_t>{4, 16});
    put(16, std::vector<std::int64_t>{3, 4, 3, 2});
    put(104, std::vector<double>{1, 0.1, 0.2, 0.3});
    put(168, std::vector<std::int64_t>{544});
    put(176, std::vector<double>{0.5, -3});
    put(500, std::vector<std::int32_t>{3});
    const LoadedFile file = loadNifti(folder, two + bytesOf(voxels, reversed));
    EXPECT_EQ(file.channels[0].slope, 0.5);
    EXPECT_EQ(file.channels[0].intercept, -3);
    EXPECT_TRUE(std::ranges::equal(file.channels[0].voxels.as<std::int16_t>(), voxels));
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(file.grid.spacing()[axis], 1e-4 * (axis + 1), 1e-15) << "microns to mm";
  }
}

TEST(NiftiFiles, OrientationIsSformThenQformThenPixdim) {
  const TempDir folder;
  const std::string voxels = bytesOf(ramp(24));
  Header1 header;
  const auto column = [&](int i) {
    return glm::dvec3(loadNifti(folder, header.bytes + voxels).grid.worldFromVoxel[i]);
  };
  EXPECT_EQ(column(1), glm::dvec3(0, 2, 0));
  EXPECT_EQ(column(3), glm::dvec3(0));
  // A quarter turn about z: x to y, y to -x; qfac -1 flips z.
  header.set<std::int16_t>(252, 1)
      .pixdim({-1, 2, 3, 4})
      .setAll<float>(256, {0, 0, std::sqrt(0.5f), 10, 20, 30});
  const glm::dvec3 x = column(0), y = column(1), z = column(2);
  EXPECT_NEAR(x.y, 2, 1e-6);
  EXPECT_NEAR(y.x, -3, 1e-6);
  EXPECT_NEAR(z.z, -4, 1e-6);
  EXPECT_NEAR(x.x, 0, 1e-6);
  EXPECT_EQ(column(3), glm::dvec3(10, 20, 30));
  header.set<std::int16_t>(254, 1).setAll<float>(280, {0, 5, 0, 1, 6, 0, 0, 2, 0, 0, 7, 3});
  EXPECT_EQ(column(0), glm::dvec3(0, 6, 0));
  EXPECT_EQ(column(3), glm::dvec3(1, 2, 3));
  header.set<std::uint8_t>(123, 1);
  EXPECT_EQ(column(3), glm::dvec3(1000, 2000, 3000)) << "metres to mm";
  header.set<std::uint8_t>(123, 2).set<float>(280 + 4, 0);
  EXPECT_NEAR(column(0).y, 2, 1e-6) << "a singular sform falls back to the qform";
}

TEST(NiftiFiles, SlopeNeverTouchesTheVoxelsAndZeroOrNanMeansNone) {
  const TempDir folder;
  const auto voxels = ramp(24);
  Header1 header;
  const auto load = [&] { return loadNifti(folder, header.bytes + bytesOf(voxels)); };
  header.set<float>(112, 0.25f).set<float>(116, 100);
  LoadedFile file = load();
  EXPECT_EQ(file.channels[0].slope, 0.25);
  EXPECT_EQ(file.channels[0].intercept, 100);
  EXPECT_TRUE(std::ranges::equal(file.channels[0].voxels.as<std::int16_t>(), voxels));
  for (const float none : {0.0f, NAN, INFINITY}) {
    header.set<float>(112, none);
    file = load();
    EXPECT_EQ(file.channels[0].slope, 1);
    EXPECT_EQ(file.channels[0].intercept, 0);
  }
  header.set<float>(112, 2).set<float>(116, NAN);
  EXPECT_EQ(load().channels[0].intercept, 0);
}

TEST(NiftiFiles, TheFifthDimensionIsChannelsAtEveryTime) {
  const TempDir folder;
  const auto voxels = ramp(2 * 2 * 1 * 3 * 2);  // 3 times, 2 components
  const std::string bytes = Header1().dim({5, 2, 2, 1, 3, 2}).bytes + bytesOf(voxels);
  const LoadedFile file = loadNifti(folder, bytes);
  ASSERT_EQ(file.channels.size(), 2u);
  const auto all = asDoubles(voxels);
  EXPECT_EQ(valuesOf(file.channels[0]), std::vector(all.begin(), all.begin() + 4));
  EXPECT_EQ(valuesOf(file.channels[1]), std::vector(all.begin() + 12, all.begin() + 16));
  EXPECT_EQ(file.channels[1].name, "a 1");
  EXPECT_EQ(file.times.count, 3u);
  const LoadedFile last = loadFile(folder / "a.nii", kTestLimit, {}, 2);
  EXPECT_EQ(valuesOf(last.channels[0]), std::vector(all.begin() + 8, all.begin() + 12));
  EXPECT_EQ(valuesOf(last.channels[1]), std::vector(all.begin() + 20, all.end()));
  EXPECT_THAT(errorOf([&] { loadFile(folder / "a.nii", kTestLimit, {}, 3); }),
              HasSubstr("a.nii: time: expected 0 to 2, found 3"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.nii",
                                   Header1().dim({5, 1, 1, 1, 1, 4097}).bytes + bytesOf(ramp(4097)))),
              HasSubstr("dim[5]: expected at most 4096 channels, found 4097"));
  EXPECT_THAT(
      loadError(writeBytes(folder / "b.nii", Header1().dim({6, 1, 1, 1, 1, 1, 2}).bytes + bytesOf(ramp(2)))),
      HasSubstr("dim[6]: expected 1, found 2"));
}

TEST(NiftiFiles, AFourthAxisIsTimesOrChannels) {
  const TempDir folder;
  const auto kindOf = [&](Header1 header, FourthAxis fourthAxis = FourthAxis::automatic) {
    const auto path = writeBytes(folder / "a.nii", header.bytes + std::string(96, 'x'));
    const VolumeInfo volume = openFile(path, {.fourthAxis = fourthAxis})->volumes[0];
    return std::to_string(volume.times.count) + " times, " + std::to_string(volume.channels.size()) +
           " channels";
  };
  const auto of = [](std::int16_t size) { return Header1().dim({4, 2, 2, 1, size}); };
  constexpr int kUnits = 123, kIntent = 68;
  EXPECT_EQ(kindOf(of(2)), "2 times, 1 channels");
  EXPECT_EQ(kindOf(of(3)), "1 times, 3 channels");
  EXPECT_EQ(kindOf(of(3).set<std::uint8_t>(kUnits, 2 + 8)), "3 times, 1 channels") << "integers every second";
  EXPECT_EQ(kindOf(of(3).type(16, 32).set<std::uint8_t>(kUnits, 2 + 8)), "1 times, 3 channels") << "floats";
  EXPECT_EQ(kindOf(of(3).type(16, 32).set<std::int16_t>(kIntent, 2001)), "3 times, 1 channels")
      << "time series";
  EXPECT_EQ(kindOf(of(2).set<std::int16_t>(kIntent, 1007)), "1 times, 2 channels") << "vectors";
  EXPECT_EQ(kindOf(of(2), FourthAxis::channel), "1 times, 2 channels");
  EXPECT_EQ(kindOf(of(3), FourthAxis::time), "3 times, 1 channels");
  EXPECT_EQ(kindOf(Header1().dim({5, 2, 1, 1, 3, 2}), FourthAxis::time), "3 times, 2 channels");
}

TEST(NiftiFiles, TimesHaveValuesIfTheirStepIsGiven) {
  const TempDir folder;
  Header1 header = Header1().dim({4, 2, 1, 1, 4}).pixdim({1, 2, 2, 2, 0.5f});
  header.set<std::uint8_t>(123, 2 + 16).set<float>(136, 10);
  const LoadedFile file = loadNifti(folder, header.bytes + bytesOf(ramp(8)));
  EXPECT_EQ(file.times.values, (std::vector<double>{10, 10.5, 11, 11.5}));
  EXPECT_EQ(file.times.unit, "ms");
  EXPECT_EQ(file.worldUnit, "mm");
}

TEST(NiftiFiles, RgbaVoxelsAreThreeChannels) {
  const TempDir folder;
  const std::string bytes =
      Header1().dim({3, 2, 1, 1}).type(2304, 32).bytes + std::string("\1\2\3\4\5\6\7\10", 8);
  const LoadedFile file = loadNifti(folder, bytes);
  ASSERT_EQ(file.channels.size(), 3u);
  EXPECT_EQ(valuesOf(file.channels[0]), (std::vector<double>{1, 5}));
  EXPECT_EQ(valuesOf(file.channels[2]), (std::vector<double>{3, 7}));
  EXPECT_EQ(file.channels[2].name, "a blue");
}

TEST(NiftiFiles, HeadersThatLieAreRefusedWithTheField) {
  const TempDir folder;
  const std::string data = bytesOf(ramp(24));
  const auto errorOfHeader = [&](const Header1& header) {
    const std::string packed = loadError(writeBytes(folder / "a.nii.gz", gzipped(header.bytes + data)));
    EXPECT_NE(packed, "");
    return loadError(writeBytes(folder / "a.nii", header.bytes + data));
  };
  EXPECT_EQ(loadError(writeBytes(folder / "a.nii", Header1().bytes + data)), "");
  EXPECT_THAT(errorOfHeader(Header1().set<std::int32_t>(0, 347)),
              HasSubstr("sizeof_hdr: expected 348 or 540, found 347"));
  EXPECT_THAT(errorOfHeader(Header1().magic("\0\0\0")), HasSubstr("magic: expected n+1 or ni1"));
  EXPECT_THAT(errorOfHeader(Header1().magic("n+2")), HasSubstr("magic: expected"));
  EXPECT_THAT(errorOfHeader(Header1().dim({0, 4, 3, 2})), HasSubstr("dim[0]: expected 1 to 7, found 0"));
  EXPECT_THAT(errorOfHeader(Header1().dim({8, 4, 3, 2})), HasSubstr("dim[0]"));
  EXPECT_THAT(errorOfHeader(Header1().dim({3, -4, 3, 2})),
              HasSubstr("dim: expected sizes of at least 1, found -4"));
  EXPECT_THAT(errorOfHeader(Header1().dim({3, 0, 3, 2})), HasSubstr("dim: expected"));
  EXPECT_THAT(errorOfHeader(Header1().dim({4, 4, 3, 2, -1})), HasSubstr("dim[4]"));
  EXPECT_THAT(errorOfHeader(Header1().type(4, 8)), HasSubstr("bitpix: expected 16 for datatype 4, found 8"));
  EXPECT_THAT(errorOfHeader(Header1().type(1, 1)), HasSubstr("datatype: expected"));
  EXPECT_THAT(errorOfHeader(Header1().type(1536, 128)), HasSubstr("datatype: expected"));
  for (const float offset : {0.0f, 351.0f, -352.0f, 352.5f, NAN, INFINITY, 1e30f}) {
    EXPECT_THAT(errorOfHeader(Header1().set<float>(108, offset)), HasSubstr("vox_offset: expected"))
        << offset;
  }
  EXPECT_THAT(errorOfHeader(Header1().set<float>(108, 1e9f)), HasSubstr("the file holds"));
  EXPECT_THAT(errorOfHeader(Header1().dim({3, 32767, 32767, 32767})), HasSubstr("the file holds"));
  EXPECT_THAT(errorOfHeader(Header1().dim({3, 1024, 1024, 100})), HasSubstr("the file holds"));
}

TEST(NiftiFiles, Version2SizesThatOverflowAreRefused) {
  const TempDir folder;
  for (const std::array<std::int64_t, 6>& dim :
       {std::array<std::int64_t, 6>{3, std::int64_t(1) << 31, 1, 1, 1, 1},
        {3, std::int64_t(1) << 62, 4, 4, 1, 1},
        {3, -1, -1, 1, 1, 1},
        {3, 1 << 30, 1 << 30, 1 << 30, 1, 1},
        {5, 2, 2, 2, std::numeric_limits<std::int64_t>::max(), 2}}) {
    std::string two(544, '\0');
    const auto put = [&](std::size_t at, auto value) { std::memcpy(&two[at], &value, sizeof value); };
    put(0, std::int32_t(540));
    two.replace(4, 8, "n+2\0\r\n\032\n", 8);
    put(12, std::int16_t(2));
    put(16, dim);
    put(168, std::int64_t(544));
    EXPECT_NE(loadError(writeBytes(folder / "a.nii", two + std::string(100, 'x'))), "") << dim[1];
  }
}

TEST(NiftiFiles, LengthsThatAreNoLengthsAreOneWithAWarning) {
  const TempDir folder;
  std::string warnings;
  const auto path = writeBytes(folder / "a.nii", Header1().pixdim({1, 0, NAN, -3}).bytes + bytesOf(ramp(24)));
  const LoadedFile file =
      loadFile(path, kTestLimit, [&](const std::string& text) { warnings += text + "\n"; });
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(1, 1, 3));
  EXPECT_THAT(warnings, AllOf(HasSubstr("pixdim[1]"), HasSubstr("pixdim[2]")));
}

TEST(NiftiFiles, EveryTruncationIsRefused) {
  const TempDir folder;
  const std::string whole = Header1().bytes + bytesOf(ramp(24));
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    EXPECT_NE(loadError(writeBytes(folder / "a.nii", whole.substr(0, length))), "") << length;
  }
  const std::string packed = gzipped(whole);
  for (std::size_t length = 0; length + 9 < packed.size(); ++length) {
    EXPECT_NE(loadError(writeBytes(folder / "a.nii.gz", packed.substr(0, length))), "") << length;
  }
}

TEST(NiftiFiles, APackedFileThatExpandsBeyondItsHeaderCostsNothing) {
  const TempDir folder;
  // 64 MiB of zeros after 48 bytes of voxels are never decompressed, so a small limit is enough.
  const std::string bomb = gzipped(Header1().bytes + bytesOf(ramp(24)) + std::string(64 << 20, '\0'));
  ASSERT_LT(bomb.size(), std::size_t(1) << 17);
  EXPECT_EQ(loadError(writeBytes(folder / "a.nii.gz", bomb), 48), "");
  EXPECT_THAT(loadError(folder / "a.nii.gz", 47), HasSubstr("the limit is 47 bytes"));
}

TEST(NiftiFiles, PairsNeedBothFiles) {
  const TempDir folder;
  const auto voxels = ramp(24);
  const std::string header = Header1().magic("ni1").set<float>(108, 0).bytes.substr(0, 348);
  writeBytes(folder / "a.hdr", header);
  EXPECT_THAT(loadError(folder / "a.hdr"), HasSubstr("expected the other file of the pair"));
  writeBytes(folder / "a.img.gz", gzipped(bytesOf(voxels)));
  EXPECT_EQ(valuesOf(loadFile(folder / "a.hdr", kTestLimit, {}).channels[0]), asDoubles(voxels));
  EXPECT_EQ(valuesOf(loadFile(folder / "a.img.gz", kTestLimit, {}).channels[0]), asDoubles(voxels));
  for (const auto& paths : {std::vector{folder / "a.hdr", folder / "a.img.gz"},
                            std::vector{folder / "a.img.gz", folder / "a.hdr"}}) {
    const auto datasets = loadDatasets(paths, kTestLimit, {});
    ASSERT_EQ(datasets.size(), 1u);
    EXPECT_EQ(datasets[0].volume->channels().size(), 1u);
  }
  writeBytes(folder / "b.img", "x");
  EXPECT_THAT(loadError(folder / "b.img"), HasSubstr("expected the other file of the pair"));
}

}  // namespace
}  // namespace scolopax::io
