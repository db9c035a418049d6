// SPDX-License-Identifier: Apache-2.0
#include "server/image_types.h"

#include <gtest/gtest.h>

namespace scolopax::server {
namespace {

TEST(ImageTypes, AreChosenByTheAcceptHeader) {
  const auto best = [](const std::string& accept) {
    const ImageType* type = acceptedImageType(&accept);
    return type ? type->format : "none";
  };
  EXPECT_EQ(acceptedImageType(nullptr)->format, "jpeg");
  EXPECT_EQ(best("*/*"), "jpeg");
  EXPECT_EQ(best("image/png"), "png");
  EXPECT_EQ(best("image/x-exr, image/png;q=0.5"), "exr");
  EXPECT_EQ(best("image/jpeg;q=0, image/*"), "png");
  EXPECT_EQ(best("image/*;q=0.5, image/png;q=0.2"), "jpeg");
  EXPECT_EQ(best("text/html"), "none");
  EXPECT_EQ(best(""), "none");
  EXPECT_EQ(best("image/png;q=0"), "none");
}

TEST(ImageTypes, AreNamedFromTheirList) {
  EXPECT_EQ(imageTypesText(&ImageType::mediaType), "image/jpeg, image/png or image/x-exr");
  EXPECT_EQ(imageTypesText(&ImageType::format, " (default)"), "jpeg (default), png or exr");
  EXPECT_EQ(imageMediaTypes(), (std::vector<std::string>{"image/jpeg", "image/png", "image/x-exr"}));
  for (const ImageType& type : imageTypes()) EXPECT_EQ(imageTypeOf(type.format), &type);
  EXPECT_EQ(imageTypeOf("gif"), nullptr);
}

TEST(ImageTypes, EncodeWhatTheirNamesSay) {
  const Image image{2, 1, {glm::vec4(0.5f), glm::vec4(1)}};
  const std::string_view beginnings[] = {"\xFF\xD8", "\x89PNG", "\x76\x2f\x31\x01"};
  for (std::size_t i = 0; i < std::size(beginnings); ++i)
    EXPECT_TRUE(imageBytes(imageTypes()[i], image, glm::vec3(0), {}).starts_with(beginnings[i])) << i;
}

}  // namespace
}  // namespace scolopax::server
