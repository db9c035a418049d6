// SPDX-License-Identifier: Apache-2.0
// Linked with a kernel whose products and sums were contracted. The comparison of bits must detect it.
#include <gtest/gtest.h>

#include "tests/cuda/controls/one_instance.h"

TEST(BuildWithContraction, DrawsOtherBitsThanTheCpu) {
  EXPECT_GT(scolopax::test::differenceOfOneInstance(), 0);
}
