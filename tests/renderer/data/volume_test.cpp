// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/volume.h"

#include <gtest/gtest.h>

#include "renderer/core/error.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

/// A volume of zeros.
std::shared_ptr<const Volume> emptyVolume(glm::ivec3 dims) {
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 0; }));
}

TEST(Volume, HasOnlyAsManyVoxelsAlongAnAxisAsFloatsCanTellApart) {
  const int most = 1 << 24;
  EXPECT_NE(float(most - 1), float(most));
  EXPECT_EQ(float(most), float(most + 1));
  EXPECT_EQ(emptyVolume({1, 1, most})->grid().dims.z, most);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 dims(1);
    dims[axis] = most + 1;
    try {
      emptyVolume(dims);
      ADD_FAILURE() << "no error for axis " << axis;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::tooLarge);
      const std::string found = axis == 0 ? "16777217x1x1" : axis == 1 ? "1x16777217x1" : "1x1x16777217";
      EXPECT_EQ(error.what(), "volume: expected at most 16777216 voxels along an axis, found " + found);
    }
  }
}

}  // namespace
}  // namespace scolopax
