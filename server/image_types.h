// SPDX-License-Identifier: Apache-2.0
// The image formats of answers: one list, from which content negotiation, encoding, descriptions and
// capabilities are derived.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/image.h"

namespace scolopax::server {

struct ImageType {
  std::string_view format;     ///< "jpeg"
  std::string_view mediaType;  ///< "image/jpeg"
  bool isFloat;                ///< keeps the values of pixels; otherwise they become 8-bit sRGB
  /// Bytes of memory that encode() needs for so many pixels.
  std::uint64_t (*memory)(std::uint64_t pixels);
  std::vector<unsigned char> (*encode)(const Image& image, glm::vec3 background, const std::stop_token& stop);
};

/// The first one is the default.
std::span<const ImageType> imageTypes();
/// nullptr if there is none with this `format`.
const ImageType* imageTypeOf(std::string_view format);
/// The image type that an Accept header prefers, or the first of several; nullptr if it accepts none. Without
/// a header, the default.
const ImageType* acceptedImageType(const std::string* accept);
std::vector<std::string> imageMediaTypes();
/// For messages: "image/jpeg, image/png or image/x-exr", with `afterFirst` after the first one.
std::string imageTypesText(std::string_view ImageType::*name, std::string_view afterFirst = "");

/// The picture as a file: jpeg with quality 95 and 4:4:4 sampling, png, or exr with float32 linear
/// premultiplied RGBA. Throws Error(cancelled) once `stop` is requested; a jpeg is completed once it has been
/// begun.
std::string imageBytes(const ImageType& type, const Image& image, glm::vec3 background,
                       const std::stop_token& stop);

}  // namespace scolopax::server
