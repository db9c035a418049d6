// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/image_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/output_file.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// A picture ready to be written: 8-bit sRGB, or the float pixels as they are.
struct Encoding {
  OIIO::ImageSpec spec;
  Image8 bytes;  ///< empty for float formats
};

/// A multiple of the rows that EXR (16) and TIFF compress together.
constexpr int kRowsAtOnce = 64;

bool isFloat(const std::string& extension) {
  return extension == "exr" || extension == "tif" || extension == "tiff";
}

void checkExtension(const std::string& extension) {
  if (!isFloat(extension) && extension != "png" && extension != "jpg" && extension != "jpeg")
    throw Error(ErrorCode::unsupported,
                "image format: expected png, jpg, exr or tif, found " + inQuotes(extension));
}

Encoding prepare(const Image& image, glm::vec3 background, const std::string& extension) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() != std::size_t(image.width) * std::size_t(image.height)) {
    throw Error(ErrorCode::badInput, "image: expected width x height pixels, at least one");
  }
  Encoding encoding;
  checkExtension(extension);
  if (isFloat(extension)) {
    encoding.spec = OIIO::ImageSpec(image.width, image.height, 4, OIIO::TypeFloat);
    encoding.spec.attribute("oiio:ColorSpace", "Linear");
    encoding.spec.attribute("compression", "zip");
    // Otherwise OpenImageIO stores the current time, and equal pictures would not be equal bytes.
    encoding.spec.attribute("DateTime", "1970:01:01 00:00:00");
  } else {
    encoding.bytes = toSrgb8(image, background);
    encoding.spec = OIIO::ImageSpec(image.width, image.height, 3, OIIO::TypeUInt8);
    encoding.spec.attribute("oiio:ColorSpace", "sRGB");
    if (extension != "png") {
      encoding.spec.attribute("Compression", "jpeg:95");
      encoding.spec.attribute("jpeg:subsampling", "4:4:4");
    }
  }
  return encoding;
}

/// The bytes of the file, made in memory, because OpenImageIO does not report every failure to write a file.
std::vector<unsigned char> encode(const Image& image, glm::vec3 background, const std::string& extension,
                                  const std::stop_token& stop = {}) {
  const Encoding encoding = prepare(image, background, extension);
  const std::string name = "image." + extension;
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput proxy(bytes);
  const auto output = OIIO::ImageOutput::create(name);
  const auto failed = [&](const std::string& why) {
    return Error(ErrorCode::io, "picture: cannot be encoded as " + extension + ": " + cleanText(why));
  };
  if (!output) throw failed(OIIO::geterror());
  if (!output->set_ioproxy(&proxy)) throw failed("not in memory");
  const bool asFloat = encoding.bytes.rgb.empty();
  bool done = output->open(name, encoding.spec);
  for (int y = 0; done && y < image.height; y += kRowsAtOnce) {
    if (stop.stop_requested())
      throw Error(ErrorCode::cancelled, "encoding cancelled: its result is no longer needed");
    const std::size_t first = std::size_t(y) * std::size_t(image.width);
    const void* rows =
        asFloat ? static_cast<const void*>(&image.pixels[first]) : &encoding.bytes.rgb[first * 3];
    done = output->write_scanlines(y, std::min(y + kRowsAtOnce, image.height), 0,
                                   asFloat ? OIIO::TypeFloat : OIIO::TypeUInt8, rows);
  }
  if (!done || !output->close()) throw failed(output->geterror());
  return bytes;
}

std::string extensionOf(const fs::path& path) {
  const std::string extension = lowerCase(path.extension().string());
  return extension.empty() ? extension : extension.substr(1);
}

}  // namespace

void checkImageName(const fs::path& path) { checkExtension(extensionOf(path)); }

bool isFloatFormat(const fs::path& path) { return isFloat(extensionOf(path)); }

void writeImage(const fs::path& path, const Image& image, glm::vec3 background) {
  const std::vector<unsigned char> bytes = encode(image, background, extensionOf(path));
  writeFile(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::vector<unsigned char> encodeImage(const Image& image, glm::vec3 background, std::string_view format,
                                       const std::stop_token& stop) {
  if (format != "png" && format != "exr") {
    throw Error(ErrorCode::unsupported, "image format: expected png or exr, found " + inQuotes(format));
  }
  // OpenEXR's own threads would make one caller take all processors.
  OIIO::attribute("exr_threads", -1);
  return encode(image, background, std::string(format), stop);
}

Image readImage(const fs::path& path) {
  requireRegularFile(path);
  constexpr int kLargestSide = 1 << 16;
  constexpr std::int64_t kMostPixels = std::int64_t(1) << 28;
  // Alpha that is not premultiplied stays so until the colours are linear.
  OIIO::ImageSpec options;
  options.attribute("oiio:UnassociatedAlpha", 1);
  const auto input = OIIO::ImageInput::open(path.string(), &options);
  if (!input) {
    throw Error(ErrorCode::badInput, shown(path) + ": is not a picture: " + cleanText(OIIO::geterror()));
  }
  const OIIO::ImageSpec spec = input->spec();
  const std::int64_t count = std::int64_t(spec.width) * spec.height;
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.width > kLargestSide ||
      spec.height > kLargestSide || count > kMostPixels || spec.nchannels < 1) {
    throw Error(ErrorCode::tooLarge, shown(path) + ": expected a picture of at most 2^28 pixels, found " +
                                         std::to_string(spec.width) + "x" + std::to_string(spec.height));
  }
  constexpr int kMostChannels = 1024;
  if (spec.nchannels > kMostChannels || count * spec.nchannels > 4 * kMostPixels) {
    throw Error(ErrorCode::tooLarge, shown(path) + ": expected a picture of few channels, found " +
                                         std::to_string(spec.nchannels));
  }
  const auto stored = std::size_t(spec.nchannels);
  std::vector<float> values(std::size_t(count) * stored);
  input->geterror();  // discards what opening recorded: only warnings
  // Row by row if possible: OpenImageIO does not report damage in several deflated strips that it reads at
  // once.
  bool whole = true;
  if (spec.tile_width != 0)
    whole = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, values.data());
  for (int y = 0; spec.tile_width == 0 && whole && y < spec.height; ++y) {
    float* row = &values[std::size_t(y) * std::size_t(spec.width) * stored];
    whole = input->read_scanline(spec.y + y, spec.z, OIIO::TypeFloat, row);
  }
  if (!whole || input->has_error()) {
    throw Error(ErrorCode::badInput, shown(path) + ": cannot be read: " + cleanText(input->geterror()));
  }

  const int channels = std::min(spec.nchannels, 4);
  const bool encoded = !spec.format.is_floating_point();
  const bool straightAlpha = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
  const bool hasAlpha = channels == 2 || channels == 4;
  Image image{spec.width, spec.height, std::vector<glm::vec4>(std::size_t(count))};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float* value = &values[i * stored];
    const float alpha = hasAlpha ? value[channels - 1] : 1.0f;
    glm::vec3 color = channels >= 3 ? glm::vec3(value[0], value[1], value[2]) : glm::vec3(value[0]);
    if (encoded) {
      // Premultiplied 8-bit files hold alpha times the encoded colour.
      const float divide = straightAlpha || alpha <= 0 ? 1.0f : alpha;
      for (int c = 0; c < 3; ++c)
        color[c] = linearFromSrgb(color[c] / divide) * (straightAlpha ? 1.0f : divide);
    }
    if (straightAlpha) color *= alpha;
    image.pixels[i] = glm::vec4(color, alpha);
  }
  return image;
}

}  // namespace scolopax::io
