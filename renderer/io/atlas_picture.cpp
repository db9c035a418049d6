// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/atlas_picture.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <span>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

/// Throws Error(badInput) for a file that is no PNG or cut off, or whose checksums are wrong: libpng would
/// print that. Of the pixels, the checksums are verified only if `pixels` says so.
void checkPngChunks(const std::filesystem::path& path, bool pixels) {
  ByteStream stream(path, ByteStream::Encoding::plain);
  const auto bad = [&](const std::string& expected, std::string_view found) {
    return Error(ErrorCode::badInput, shown(path) + ": expected " + expected + ", found " + inQuotes(found));
  };
  const auto left = [&] { return stream.largestSize() - stream.position(); };
  std::array<unsigned char, 8> start{};
  const auto text = [&](std::size_t at) {
    return std::string_view(reinterpret_cast<const char*>(start.data()) + at, start.size() - at);
  };
  const auto number = [&] {
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < 4; ++i) bytes = bytes << 8 | start[i];
    return bytes;
  };
  stream.readSome(std::as_writable_bytes(std::span(start)));
  if (text(0) != "\x89PNG\r\n\x1A\n") throw bad("PNG", text(0));
  for (bool first = true, last = false; !last; first = false) {
    stream.read(std::as_writable_bytes(std::span(start)));
    const std::string type(text(4));
    const std::uint64_t length = number();
    if (first && type != "IHDR") throw bad("the chunk IHDR", type);
    if (left() < 4 || length > left() - 4) throw bad("a whole chunk " + type, "the end of the file");
    last = type == "IEND";
    if (type == "IDAT" && !pixels) {
      stream.skip(length + 4);
      continue;
    }
    auto sum = ::crc32(0, start.data() + 4, 4);
    std::array<unsigned char, 1 << 14> block;
    for (std::uint64_t done = 0; done < length;) {
      const auto some = std::size_t(std::min<std::uint64_t>(length - done, block.size()));
      stream.read(std::as_writable_bytes(std::span(block)).first(some));
      sum = ::crc32(sum, block.data(), uInt(some));
      done += some;
    }
    stream.read(std::as_writable_bytes(std::span(start)).first(4));
    if (number() != sum) throw bad("a sound chunk", type);
  }
}

}  // namespace

AtlasPicture::AtlasPicture(const std::filesystem::path& path, const AtlasTiles& tiles)
    : path_(path), file_(shown(path)), tiles_(tiles), input_(OIIO::ImageInput::create("png")) {
  checkPngChunks(path, false);
  const std::uint64_t fileBytes = ByteStream(path, ByteStream::Encoding::plain).largestSize();
  OIIO::ImageSpec options, spec;
  options.attribute("oiio:UnassociatedAlpha", 1);  // alpha is a channel like the others
  if (!input_ || !input_->open(path.string(), spec, options))
    throw Error(ErrorCode::badInput, file_ + ": expected PNG, found: " +
                                         cleanText(input_ ? input_->geterror() : OIIO::geterror()));
  const std::int64_t rows = (std::int64_t(tiles.dims.z) + tiles.columns - 1) / tiles.columns,
                     width = std::int64_t(tiles.dims.x) * tiles.columns, height = rows * tiles.dims.y;
  if (spec.width < width || spec.height < height)
    throw Error(ErrorCode::badInput, file_ + ": expected at least " + std::to_string(width) + "x" +
                                         std::to_string(height) + " pixels for the tiles, found " +
                                         std::to_string(spec.width) + "x" + std::to_string(spec.height));
  // Deflate expands at most so far, and a pixel has at least one bit.
  constexpr std::uint64_t kDeflateLimit = 1032;
  const std::uint64_t pixels = std::uint64_t(spec.width) * std::uint64_t(spec.height);
  if (pixels / 8 > saturatingProduct(fileBytes, kDeflateLimit))
    throw Error(ErrorCode::badInput, file_ + ": " + std::to_string(spec.width) + "x" +
                                         std::to_string(spec.height) + " pixels need more than the file's " +
                                         byteCount(fileBytes));
}

StoredType AtlasPicture::sampleType(int sample) const {
  const OIIO::ImageSpec& spec = input_->spec();
  if (sample >= spec.nchannels)
    throw Error(ErrorCode::badInput, file_ +
                                         ": expected a sample for each channel that images gives it, found " +
                                         std::to_string(spec.nchannels));
  return spec.format == OIIO::TypeUInt16 ? StoredType::u16 : StoredType::u8;
}

void AtlasPicture::read(const std::vector<AtlasSample>& samples, Loading& loading) {
  checkPngChunks(path_, true);
  const OIIO::ImageSpec spec = input_->spec();
  for (const AtlasSample& sample : samples)
    if (sampleType(sample.index) != sample.writer->type())
      throw Error(ErrorCode::badInput, file_ + ": expected the same samples as before, found others");
  const std::size_t numberBytes = spec.format.size(), pixelBytes = spec.pixel_bytes(true),
                    width = std::size_t(tiles_.dims.x), rowBytes = pixelBytes * std::size_t(spec.width);
  // An interlaced picture is unpacked as a whole.
  loading.checkMemory(file_ + ": its pixels", saturatingProduct(rowBytes, std::uint64_t(spec.height)));
  std::vector<std::byte> row(rowBytes);
  input_->geterror();  // discards what opening recorded: only warnings
  for (int y = 0; y < spec.height; ++y) {
    const int tileRow = y / tiles_.dims.y;
    if (std::int64_t(tileRow) * tiles_.columns >= tiles_.dims.z) break;
    if (!input_->read_native_scanline(0, 0, spec.y + y, spec.z, row.data()) || input_->has_error())
      throw Error(ErrorCode::badInput, file_ + ": row " + std::to_string(y) +
                                           " cannot be decoded: " + cleanText(input_->geterror()));
    for (int column = 0; column < tiles_.columns; ++column) {
      const int z = tileRow * tiles_.columns + column;
      if (z >= tiles_.dims.z) break;
      const auto first =
          (std::size_t(z) * std::size_t(tiles_.dims.y) + std::size_t(y % tiles_.dims.y)) * width;
      for (const AtlasSample& sample : samples)
        sample.writer->writeStrided(
            first, width,
            row.data() + std::size_t(column) * width * pixelBytes + std::size_t(sample.index) * numberBytes,
            std::ptrdiff_t(pixelBytes));
    }
  }
}

}  // namespace scolopax::io
