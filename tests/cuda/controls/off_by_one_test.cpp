// SPDX-License-Identifier: Apache-2.0
// Linked with a kernel whose guard admits one row too many. The checked memory must detect it.
#include <gmock/gmock.h>

#include "renderer/core/error.h"
#include "tests/cuda/controls/one_instance.h"
#include "tests/cuda/substitute_runtime.h"

TEST(BuildWithAGuardThatIsOffByOne, IsCaughtWritingBeyondThePicture) {
  EXPECT_THROW(scolopax::test::differenceOfOneInstance(), scolopax::Error);
  EXPECT_THAT(substitute::lastFault(), testing::HasSubstr("renderPixels"));
  EXPECT_THAT(substitute::lastFault(), testing::HasSubstr("store outside of memory"));
}
