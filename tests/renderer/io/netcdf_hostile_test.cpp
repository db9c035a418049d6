// SPDX-License-Identifier: Apache-2.0
// NetCDF files that are damaged or lie.
#if SCOLOPAX_HAS_NETCDF
#include <gmock/gmock.h>

#include <random>

#include "tests/renderer/io/io_test_support.h"
#include "tests/renderer/io/netcdf_test_support.h"

namespace scolopax::io {
namespace {

using testing::HasSubstr;

TEST(HostileNetcdf, FilesWithoutVolumesAndOtherFilesAreRefused) {
  const TempDir folder;
  {
    NetcdfMaker maker(folder / "a.nc", 0);
    maker.variable("a", NC_FLOAT, {{"x", 4}}, netcdfRamp(4));
    maker.variable("b", NC_CHAR, kZyx, {});
    maker.write();
  }
  EXPECT_THAT(loadError(folder / "a.nc"), HasSubstr("expected a variable of numbers with 2 or 3 dimensions"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.nc", "hello")), HasSubstr("expected a NetCDF file"));
  EXPECT_THAT(loadError(writeBytes(folder / "c.nc", "CDF\x01")), HasSubstr("c.nc"));
}

TEST(HostileNetcdf, TruncatedAndDamagedFilesEndInErrorsOrVolumes) {
  const TempDir folder;
  std::mt19937 random(1);
  for (const int mode : {0, NC_NETCDF4}) {
    {
      NetcdfMaker maker(folder / "a.nc", mode);
      maker.variable("a", NC_FLOAT, kZyx, netcdfRamp(24));
      maker.variable("x", NC_FLOAT, {{"x", 4}}, netcdfRamp(4));
      maker.attribute("a", "units", "m");
      maker.write();
    }
    std::ifstream stream(folder / "a.nc", std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    const auto load = [&](const std::string& changed) {
      return loadError(writeBytes(folder / "b.nc", changed));
    };
    for (std::size_t size = 0; size < bytes.size(); size += std::max<std::size_t>(bytes.size() / 32, 1))
      load(bytes.substr(0, size));
    EXPECT_THAT(load(bytes.substr(0, bytes.size() / 2)), HasSubstr("b.nc"));
    for (int round = 0; round < 50; ++round) {
      std::string damaged = bytes;
      for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = char(random());
      load(damaged);
    }
  }
}

TEST(HostileNetcdf, SizesThatLieAreRefused) {
  // Classic, byte by byte: one variable of bytes, 2^31 - 1 along each dimension.
  const auto be = [](std::uint32_t number) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(number >> shift);
    return bytes;
  };
  std::string bytes = std::string("CDF\x01") + be(0) + be(10) + be(3);
  for (const char* name : {"z", "y", "x"}) bytes += be(1) + name + std::string(3, '\0') + be(0x7FFFFFFF);
  bytes += be(0) + be(0) + be(11) + be(1) + be(1) + std::string("a\0\0\0", 4) + be(3) + be(0) + be(1) +
           be(2) + be(0) + be(0) + be(1) + be(0xFFFFFFFF) + be(120);
  const TempDir folder;
  EXPECT_THAT(loadError(writeBytes(folder / "a.nc", bytes)), HasSubstr("a.nc"));
}

}  // namespace
}  // namespace scolopax::io
#endif
