// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/tiff_decode.h"

#include <algorithm>
#include <cstring>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {

std::unique_ptr<OIIO::ImageInput> openTiffPage(TiffPages& pages, std::size_t page, std::size_t level) {
  pages.select(page, level);
  OIIO::ImageSpec options, spec;
  options.attribute("oiio:UnassociatedAlpha", 1);
  options.attribute("oiio:RawColor", 1);
  auto input = OIIO::ImageInput::create("tiff");
  if (!input || !input->set_ioproxy(&pages) || !input->open(pages.filename(), spec, options)) {
    throw Error(ErrorCode::badInput, shown(pages.filename()) + ": page " + std::to_string(page + 1) + ": " +
                                         cleanText(input ? input->geterror() : OIIO::geterror()));
  }
  return input;
}

StoredType tiffStoredType(const std::string& file, const OIIO::ImageSpec& spec) {
  // OpenImageIO rescales other depths to the next larger type.
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
  if (bits == int(spec.format.size()) * 8) {
    switch (spec.format.basetype) {
      case OIIO::TypeDesc::INT8:
        return StoredType::i8;
      case OIIO::TypeDesc::UINT8:
        return StoredType::u8;
      case OIIO::TypeDesc::INT16:
        return StoredType::i16;
      case OIIO::TypeDesc::UINT16:
        return StoredType::u16;
      case OIIO::TypeDesc::INT32:
        return StoredType::i32;
      case OIIO::TypeDesc::UINT32:
        return StoredType::u32;
      case OIIO::TypeDesc::HALF:
        return StoredType::f16;
      case OIIO::TypeDesc::FLOAT:
        return StoredType::f32;
      case OIIO::TypeDesc::DOUBLE:
        return StoredType::f64;
      default:
        break;
    }
  }
  throw Error(ErrorCode::unsupported,
              file + ": BitsPerSample: expected integers of 8, 16 or 32 bits or floats, found " +
                  std::to_string(bits) + " bits as " + spec.format.c_str());
}

std::uint64_t tiffExpansion(const OIIO::ImageSpec& spec) {
  const std::string compression = spec.get_string_attribute("compression", "none");
  if (compression == "none") return 1;
  if (compression == "packbits") return 64;
  if (compression == "zip") return 1032;
  return 1 << 15;
}

bool readTiffPixels(OIIO::ImageInput& input, std::vector<std::byte>& page) {
  const OIIO::ImageSpec spec = input.spec();
  const std::size_t pixelBytes = spec.pixel_bytes(true), rowBytes = pixelBytes * std::size_t(spec.width);
  if (spec.tile_width == 0) {
    for (int y = 0; y < spec.height; ++y) {
      if (!input.read_native_scanline(0, 0, spec.y + y, spec.z, &page[std::size_t(y) * rowBytes]))
        return false;
    }
    return true;
  }
  constexpr std::uint64_t kLargestTile = std::uint64_t(1) << 28;
  const std::size_t tileRowBytes = pixelBytes * std::size_t(spec.tile_width);
  if (spec.tile_depth > 1 || saturatingProduct(tileRowBytes, std::uint64_t(spec.tile_height)) > kLargestTile)
    return false;
  std::vector<std::byte> tile(tileRowBytes * std::size_t(spec.tile_height));
  for (int y = 0; y < spec.height; y += spec.tile_height) {
    for (int x = 0; x < spec.width; x += spec.tile_width) {
      if (!input.read_native_tile(0, 0, spec.x + x, spec.y + y, spec.z, tile.data())) return false;
      const std::size_t bytes = pixelBytes * std::size_t(std::min(spec.tile_width, spec.width - x));
      for (int row = 0; row < std::min(spec.tile_height, spec.height - y); ++row) {
        std::memcpy(&page[std::size_t(y + row) * rowBytes + std::size_t(x) * pixelBytes],
                    &tile[std::size_t(row) * tileRowBytes], bytes);
      }
    }
  }
  return true;
}

}  // namespace scolopax::io
