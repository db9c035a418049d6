// SPDX-License-Identifier: Apache-2.0
// The instance that the other controls break, unbroken.
#include <gtest/gtest.h>

#include "tests/cuda/controls/one_instance.h"

TEST(UnbrokenBuild, DrawsWhatTheCpuDraws) { EXPECT_EQ(scolopax::test::differenceOfOneInstance(), 0); }
