// SPDX-License-Identifier: Apache-2.0
#include "server/encoder.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "renderer/core/error.h"

namespace scolopax::server {
namespace {

// The frame header of a baseline JPEG (ISO 10918-1, B.2.2): sides and the first component's sampling.
struct StartOfFrame {
  int width = 0, height = 0, components = 0, lumaSampling = 0;
};
StartOfFrame startOfFrame(const std::vector<std::uint8_t>& jpeg) {
  for (std::size_t at = 2; at + 12 < jpeg.size();) {
    if (jpeg[at + 1] == 0xC0)
      return {jpeg[at + 7] * 256 + jpeg[at + 8], jpeg[at + 5] * 256 + jpeg[at + 6], jpeg[at + 9],
              jpeg[at + 11]};
    at += 2 + std::size_t(jpeg[at + 2]) * 256 + jpeg[at + 3];
  }
  return {};
}

Image8 gradient(int width, int height) {
  Image8 image{width, height, std::vector<std::uint8_t>(std::size_t(width * height * 3))};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = std::uint8_t(i * 7);
  return image;
}

TEST(Encoder, WritesAJpegOfTheGivenSize) {
  const auto jpeg = encodeJpeg(gradient(37, 21), 90, ChromaSampling::full444);
  ASSERT_GT(jpeg.size(), 4u);
  EXPECT_EQ(jpeg[0], 0xFF);
  EXPECT_EQ(jpeg[1], 0xD8);
  EXPECT_EQ(jpeg[jpeg.size() - 1], 0xD9);
  const StartOfFrame frame = startOfFrame(jpeg);
  EXPECT_EQ(frame.width, 37);
  EXPECT_EQ(frame.height, 21);
  EXPECT_EQ(frame.components, 3);
}

TEST(Encoder, SubsamplesChromaOnlyWhenAsked) {
  EXPECT_EQ(startOfFrame(encodeJpeg(gradient(16, 16), 90, ChromaSampling::full444)).lumaSampling, 0x11);
  EXPECT_EQ(startOfFrame(encodeJpeg(gradient(16, 16), 90, ChromaSampling::half420)).lumaSampling, 0x22);
}

TEST(Encoder, GivesTheSameBytesForTheSamePicture) {
  EXPECT_EQ(encodeJpeg(gradient(64, 48), 75, ChromaSampling::half420),
            encodeJpeg(gradient(64, 48), 75, ChromaSampling::half420));
}

TEST(Encoder, RefusesAnImageWhosePixelsAreMissing) {
  EXPECT_THROW(encodeJpeg(Image8{4, 4, std::vector<std::uint8_t>(47)}, 75, ChromaSampling::half420), Error);
  EXPECT_THROW(encodeJpeg(Image8{}, 75, ChromaSampling::half420), Error);
}

TEST(Encoder, RefusesWhatJpegCannotHold) {
  try {
    encodeJpeg(Image8{65501, 1, std::vector<std::uint8_t>(65501 * 3)}, 75, ChromaSampling::half420);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::tooLarge);
  }
}

}  // namespace
}  // namespace scolopax::server
