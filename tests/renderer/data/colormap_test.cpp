// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/colormap.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/data/curve.h"
#include "renderer/data/image.h"
#include "renderer/kernel/classify.h"

namespace scolopax {
namespace {

TEST(Colormap, HasTheColoursOfItsTableInFewKnots) {
  for (const char* name : {"viridis", "magma", "inferno", "plasma", "turbo"}) {
    const auto knots = colormapKnots(name);
    EXPECT_LT(knots.size(), 80u) << name;
    const Curve<glm::vec3> curve = makeCurve(knots, name);
    OIIO::ImageBuf ramp(OIIO::ImageSpec(256, 1, 1, OIIO::TypeDesc::FLOAT));
    for (int i = 0; i < 256; ++i) {
      const float x = float(i) / 255;
      ramp.setpixel(i, 0, &x);
    }
    const OIIO::ImageBuf mapped = OIIO::ImageBufAlgo::color_map(ramp, 0, name, {}, 1);
    for (int i = 0; i < 256; ++i) {
      float expected[3];
      mapped.getpixel(i, 0, expected, 3);
      const glm::vec3 found = kernel::evaluate(curve.view(), float(i) / 255);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(255 * srgbFromLinear(found[c]), 255 * srgbFromLinear(expected[c]), 0.51)
            << name << ' ' << i;
    }
  }
}

TEST(Colormap, GrayIsEvenInDisplayValues) {
  const auto knots = colormapKnots("gray");
  EXPECT_LT(knots.size(), 40u);
  const Curve<glm::vec3> curve = makeCurve(knots, "gray");
  for (int i = 0; i < 256; ++i)
    EXPECT_NEAR(255 * srgbFromLinear(kernel::evaluate(curve.view(), float(i) / 255)[1]), i, 0.51);
}

TEST(Colormap, HotEndsAtWhite) {
  const auto knots = colormapKnots("hot");
  EXPECT_EQ(knots.back().position, 1);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(knots.back().color[c], 1, 1e-6);
  EXPECT_LT(knots.size(), 120u);  // of 257
}

}  // namespace
}  // namespace scolopax
