// SPDX-License-Identifier: Apache-2.0
// HDF5 files that are damaged, lie, or lead elsewhere.
#if SCOLOPAX_HAS_HDF5
#include <gmock/gmock.h>

#include <random>

#include "tests/renderer/io/hdf5_test_support.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(HostileHdf5, CyclesAndSoftLinksAreHarmless) {
  const TempDir folder;
  {
    Hdf5Maker maker(folder / "a.h5");
    maker.array("/g/a", {1, 2, 2}, rampOf<float>(4));
    H5Lcreate_hard(maker.file(), "/", maker.file(), "/g/again", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/g", maker.file(), "/g/soft", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/nowhere", maker.file(), "/dangling", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/loop", maker.file(), "/loop", H5P_DEFAULT, H5P_DEFAULT);
  }
  EXPECT_THAT(hdf5Paths(folder / "a.h5"), ElementsAre("g/a"));
}

TEST(HostileHdf5, NothingOfOtherFilesIsRead) {
  const TempDir folder;
  Hdf5Maker(folder / "other.h5").array("/a", {1, 2, 2}, rampOf<float>(4));
  writeBytes(folder / "values", std::string(16, 'x'));
  const std::vector<hsize_t> dims{1, 2, 2};
  const hid_t space = H5Screate_simple(3, dims.data(), nullptr), list = H5Pcreate(H5P_DATASET_CREATE);
  {
    Hdf5Maker maker(folder / "link.h5");
    H5Lcreate_external((folder / "other.h5").c_str(), "/a", maker.file(), "/a", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/a", maker.file(), "/b", H5P_DEFAULT, H5P_DEFAULT);
  }
  EXPECT_THAT(loadError(folder / "link.h5"), HasSubstr("link.h5:/a leads to another file"));
  {
    Hdf5Maker maker(folder / "external.h5");
    H5Pset_external(list, (folder / "values").c_str(), 0, 16);
    H5Dclose(H5Dcreate2(maker.file(), "/a", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, list, H5P_DEFAULT));
  }
  EXPECT_THAT(loadError(folder / "external.h5"), HasSubstr("external.h5:/a has its values in other files"));
  const hid_t other = H5Pcreate(H5P_DATASET_CREATE);
  std::vector<std::string> warnings;
  {
    Hdf5Maker maker(folder / "virtual.h5");
    H5Pset_virtual(other, space, (folder / "other.h5").c_str(), "/a", space);
    H5Dclose(H5Dcreate2(maker.file(), "/a", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, other, H5P_DEFAULT));
    maker.array("/own", {1, 2, 2}, rampOf<float>(4));
  }
  EXPECT_THAT(hdf5Paths(folder / "virtual.h5", [&](const std::string& line) { warnings.push_back(line); }),
              ElementsAre("own"));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("virtual.h5:/a has its values in other files")));
  H5Pclose(list);
  H5Pclose(other);
  H5Sclose(space);
}

std::size_t copyHdf5(unsigned, std::size_t, const unsigned*, std::size_t bytes, std::size_t*, void**) {
  return bytes;
}

TEST(HostileHdf5, AnUnknownFilterIsNamed) {
  const TempDir folder;
  const H5Z_class2_t filter{H5Z_CLASS_T_VERS, 300, 1, 1, "quantum", nullptr, nullptr, copyHdf5};
  H5Zregister(&filter);
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  const std::vector<hsize_t> dims{1, 2, 2};
  H5Pset_chunk(list, 3, dims.data());
  H5Pset_filter(list, 300, 0, 0, nullptr);
  const hid_t space = H5Screate_simple(3, dims.data(), nullptr);
  {
    Hdf5Maker maker(folder / "a.h5");
    H5Dclose(H5Dcreate2(maker.file(), "/a", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, list, H5P_DEFAULT));
  }
  H5Sclose(space);
  H5Pclose(list);
  H5Zunregister(300);
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("a.h5:/a is packed by the HDF5 filter \"quantum\""));
}

TEST(HostileHdf5, FilesWithoutVolumesSaySo) {
  const TempDir folder;
  { Hdf5Maker maker(folder / "empty.h5"); }
  EXPECT_THAT(loadError(folder / "empty.h5"), HasSubstr("expected an array of numbers of 2 to 4 dimensions"));
  {
    Hdf5Maker maker(folder / "text.h5");
    maker.array("/a", {2, 2, 2}, std::vector<float>(), {.type = H5T_C_S1});
  }
  EXPECT_THAT(loadError(folder / "text.h5"), HasSubstr("expected an array of numbers of 2 to 4 dimensions"));
  EXPECT_THAT(loadError(writeBytes(folder / "not.h5", "hello")), HasSubstr("expected an HDF5 file"));
}

TEST(HostileHdf5, SizesThatCannotBeAreRefusedBeforeMemoryIsTaken) {
  const TempDir folder;
  const hsize_t huge = hsize_t(1) << 40;
  Hdf5Maker(folder / "a.h5").array("/a", {huge, 4, 4}, std::vector<float>(), {.chunk = {1, 4, 4}});
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("a.h5:/a"));
  Hdf5Maker(folder / "b.h5").array("/a", {10000, 10000, 10000}, std::vector<float>(), {.chunk = {1, 64, 64}});
  EXPECT_THAT(loadError(folder / "b.h5"), HasSubstr("4000000000000 bytes of memory, the limit is"));
  // Memory for the voxels, and none for the chunk that they are in.
  Hdf5Maker(folder / "c.h5")
      .array("/a", {16, 1024, 1024}, std::vector<std::uint8_t>(), {.chunk = {16, 1024, 1024}});
  EXPECT_EQ(loadError(folder / "c.h5", 34 << 20), "");
  EXPECT_THAT(loadError(folder / "c.h5", 30 << 20), HasSubstr("c.h5: a chunk needs"));
}

TEST(HostileHdf5, DeepGroupsAreLeftOut) {
  const TempDir folder;
  std::string path;
  for (int i = 0; i < 200; ++i) path += "/g";
  {
    Hdf5Maker maker(folder / "a.h5");
    maker.array("/a", {1, 2, 2}, rampOf<float>(4));
    maker.array(path + "/b", {1, 2, 2}, rampOf<float>(4));
  }
  std::vector<std::string> warnings;
  EXPECT_THAT(hdf5Paths(folder / "a.h5", [&](const std::string& line) { warnings.push_back(line); }),
              ElementsAre("a"));
  EXPECT_THAT(warnings, Contains(HasSubstr("they lie too deep")));
}

TEST(HostileHdf5, ALoadCanBeCancelled) {
  const TempDir folder;
  Hdf5Maker(folder / "a.h5").array("/a", {2, 2, 2}, rampOf<float>(8));
  const auto file = openFile(folder / "a.h5");
  std::stop_source stop;
  stop.request_stop();
  try {
    load(*file, {}, LoadOptions{.stop = stop.get_token()});
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

TEST(HostileHdf5, AFileThatChangesAfterItWasOpenedIsRefused) {
  const TempDir folder;
  Hdf5Maker(folder / "a.h5").array("/a", {2, 2, 2}, rampOf<float>(8));
  const auto file = openFile(folder / "a.h5");
  Hdf5Maker(folder / "a.h5").array("/a", {2, 2, 3}, rampOf<float>(12));
  EXPECT_THAT(errorOf([&] { load(*file, {}, LoadOptions{}); }),
              HasSubstr("expected the same array as before"));
  Hdf5Maker(folder / "a.h5").array("/a", {2, 2, 2}, rampOf<double>(8));
  EXPECT_THAT(errorOf([&] { load(*file, {}, LoadOptions{}); }),
              HasSubstr("expected the same array as before"));
  Hdf5Maker(folder / "a.h5").array("/b", {2, 2, 2}, rampOf<float>(8));
  EXPECT_THAT(errorOf([&] { load(*file, {}, LoadOptions{}); }), HasSubstr("a.h5:/a: cannot be opened"));
}

/// The bytes of a small file with two packed arrays and attributes.
std::string smallHdf5(const TempDir& folder) {
  {
    Hdf5Maker maker(folder / "small.h5");
    maker.array("/g/a", {2, 3, 4}, rampOf<std::uint16_t>(24),
                {.chunk = {1, 3, 4}, .deflate = 6, .shuffle = true});
    maker.array("/b", {2, 3, 4}, rampOf<float>(24));
    maker.attribute("/g/a", "element_size_um", std::vector<double>{3, 2, 1});
    maker.attribute("/g", "names", std::vector<std::string>{"one", "two"});
  }
  std::ifstream file(folder / "small.h5", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Loads all; any result other than volumes or an Error fails the test.
void loadAllOf(const fs::path& path) {
  errorOf([&] {
    const auto file = openFile(path);
    for (std::size_t i = 0; i < file->volumes.size(); ++i)
      errorOf([&] { load(*file, {.volume = i}, LoadOptions{.memoryLimitBytes = kTestLimit}); });
  });
}

TEST(HostileHdf5, TruncatedFilesAreRefused) {
  const TempDir folder;
  const std::string bytes = smallHdf5(folder);
  for (std::size_t size = 0; size < bytes.size(); size += 101) {
    const fs::path path = writeBytes(folder / "cut.h5", bytes.substr(0, size));
    EXPECT_THAT(loadError(path), HasSubstr("cut.h5")) << size;
  }
}

TEST(HostileHdf5, DamagedFilesEndInErrorsOrVolumes) {
  const TempDir folder;
  const std::string bytes = smallHdf5(folder);
  std::mt19937 random(1);
  for (int round = 0; round < 100; ++round) {
    std::string damaged = bytes;
    for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = char(random());
    loadAllOf(writeBytes(folder / "damaged.h5", damaged));
  }
}

}  // namespace
}  // namespace scolopax::io
#endif
