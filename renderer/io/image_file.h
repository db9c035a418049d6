// SPDX-License-Identifier: Apache-2.0
// Pictures as files and in memory, through OpenImageIO.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/image.h"

namespace scolopax::io {

/// Writes by extension: .exr and .tif as float32 linear premultiplied RGBA; .png and .jpg as 8-bit sRGB over
/// `background`. The file is there whole or not at all. Throws Error(unsupported) for another extension,
/// Error(io) when it cannot be written.
void writeImage(const std::filesystem::path& path, const Image& image, glm::vec3 background);

/// Throws Error(unsupported) when writeImage knows no format of that extension.
void checkImageName(const std::filesystem::path& path);

/// Whether writeImage keeps the values under this name as they are.
bool isFloatFormat(const std::filesystem::path& path);

/// Reads any picture OpenImageIO knows, as linear premultiplied RGBA (8- and 16-bit files are taken as sRGB).
Image readImage(const std::filesystem::path& path);

/// The bytes of a picture in memory: format "png" (8-bit sRGB RGB) or "exr" (float32 linear premultiplied
/// RGBA).
std::vector<unsigned char> encodeImage(const Image& image, glm::vec3 background, std::string_view format);

}  // namespace scolopax::io
