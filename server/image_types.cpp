// SPDX-License-Identifier: Apache-2.0
#include "server/image_types.h"

#include <algorithm>
#include <charconv>
#include <glm/vec4.hpp>

#include "renderer/io/image_file.h"
#include "server/encoder.h"
#include "server/net/url.h"

namespace scolopax::server {
namespace {

using net::trimmed;

/// Maximum size of a file without its pixels, in bytes.
constexpr std::uint64_t kFileBytes = 1 << 20;

constexpr ImageType kImageTypes[] = {
    {"jpeg", "image/jpeg", false, jpegMemory,
     [](const Image& image, glm::vec3 background, const std::stop_token&) {
       return encodeJpeg(toSrgb8(image, background), 95, ChromaSampling::full444);
     }},
    // 8 bits per component, before and after encoding.
    {"png", "image/png", false, [](std::uint64_t pixels) { return pixels * 4 * 3 + kFileBytes; },
     [](const Image& image, glm::vec3 background, const std::stop_token& stop) {
       return io::encodeImage(image, background, "png", stop);
     }},
    // The floats, and two copies of the encoded picture.
    {"exr", "image/x-exr", true,
     [](std::uint64_t pixels) { return pixels * 3 * sizeof(glm::vec4) + kFileBytes; },
     [](const Image& image, glm::vec3 background, const std::stop_token& stop) {
       return io::encodeImage(image, background, "exr", stop);
     }},
};

/// Calls f with each part between separators.
template <class F>
void forEachPart(std::string_view text, char separator, F&& f) {
  for (;;) {
    const auto end = text.find(separator);
    f(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

/// The quality that Accept gives to a media type, by the most specific range that matches it (RFC 9110,
/// 12.5.1).
double qualityOf(std::string_view accept, std::string_view mediaType) {
  double quality = 0;
  int bestSpecificity = -1;
  forEachPart(accept, ',', [&](std::string_view range) {
    const std::string_view name = trimmed(range.substr(0, range.find(';')));
    const int specificity = name == mediaType ? 2 : name == "image/*" ? 1 : name == "*/*" ? 0 : -1;
    if (specificity < 0 || specificity < bestSpecificity) return;
    bestSpecificity = specificity;
    quality = 1;
    forEachPart(range, ';', [&](std::string_view part) {
      if (part.substr(0, 2) == "q=") std::from_chars(part.data() + 2, part.data() + part.size(), quality);
    });
  });
  return quality;
}

}  // namespace

std::span<const ImageType> imageTypes() { return kImageTypes; }

const ImageType* imageTypeOf(std::string_view format) {
  const auto found = std::find_if(std::begin(kImageTypes), std::end(kImageTypes),
                                  [&](const ImageType& type) { return type.format == format; });
  return found == std::end(kImageTypes) ? nullptr : found;
}

const ImageType* acceptedImageType(const std::string* accept) {
  if (!accept) return kImageTypes;
  const ImageType* best = nullptr;
  double bestQuality = 0;
  for (const ImageType& type : kImageTypes) {
    const double quality = qualityOf(*accept, type.mediaType);
    if (quality > bestQuality) {
      best = &type;
      bestQuality = quality;
    }
  }
  return best;
}

std::vector<std::string> imageMediaTypes() {
  std::vector<std::string> names;
  for (const ImageType& type : kImageTypes) names.emplace_back(type.mediaType);
  return names;
}

std::string imageTypesText(std::string_view ImageType::*name, std::string_view afterFirst) {
  std::string text;
  constexpr std::size_t kCount = std::size(kImageTypes);
  for (std::size_t i = 0; i < kCount; ++i) {
    text.append(i == 0 ? "" : i + 1 < kCount ? ", " : " or ").append(kImageTypes[i].*name);
    if (i == 0) text.append(afterFirst);
  }
  return text;
}

std::string imageBytes(const ImageType& type, const Image& image, glm::vec3 background,
                       const std::stop_token& stop) {
  const auto bytes = type.encode(image, background, stop);
  return {bytes.begin(), bytes.end()};
}

}  // namespace scolopax::server
