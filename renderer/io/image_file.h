// SPDX-License-Identifier: Apache-2.0
// Pictures as files and in memory, through OpenImageIO.
#pragma once
#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/image.h"

namespace scolopax::io {

/// Writes by extension: .exr and .tif as float32 linear premultiplied RGBA; .png and .jpg as 8-bit sRGB over
/// `background`. The file is written whole or not at all (writeFile). Throws Error(unsupported) for another
/// extension, Error(io) if it cannot be written.
void writeImage(const std::filesystem::path& path, const Image& image, glm::vec3 background);

/// Throws Error(unsupported) if writeImage has no format for the extension.
void checkImageName(const std::filesystem::path& path);

/// Whether writeImage stores float values unchanged under this name.
bool isFloatFormat(const std::filesystem::path& path);

/// Reads any picture OpenImageIO knows, as linear premultiplied RGBA (8- and 16-bit files are taken as sRGB).
/// Throws Error(badInput) for a file that is not a picture or is damaged, Error(tooLarge) for more than 2^28
/// pixels, a side beyond 65536 or too many channels, and as requireRegularFile.
Image readImage(const std::filesystem::path& path);

/// The bytes of a picture in memory: format "png" (8-bit sRGB RGB) or "exr" (float32 linear premultiplied
/// RGBA). Works on the calling thread only. Throws Error(cancelled) within some rows once `stop` is
/// requested.
std::vector<unsigned char> encodeImage(const Image& image, glm::vec3 background, std::string_view format,
                                       const std::stop_token& stop = {});

}  // namespace scolopax::io
