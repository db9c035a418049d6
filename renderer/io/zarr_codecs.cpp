// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_codecs.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cstring>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/stored_type.h"
#include "renderer/io/text.h"

#if SCOLOPAX_HAS_BLOSC
#include <blosc.h>
#endif
#if SCOLOPAX_HAS_ZSTD
#include <zstd.h>
#endif
#if SCOLOPAX_HAS_LZ4
#include <lz4.h>
#endif

namespace scolopax::io {
namespace {

using ZarrBytes = std::vector<std::byte>;

struct ZarrPackingName {
  std::string_view name;
  ZarrPacking packing;
  std::string_view lacks;  ///< the package of a library that this build lacks
};
constexpr ZarrPackingName kZarrPackings[] = {
    {"zlib", ZarrPacking::zlib, ""},
    {"gzip", ZarrPacking::gzip, ""},
    {"zstd", ZarrPacking::zstd, SCOLOPAX_LACKS_ZSTD},
    {"blosc", ZarrPacking::blosc, SCOLOPAX_LACKS_BLOSC},
    {"lz4", ZarrPacking::lz4, SCOLOPAX_LACKS_LZ4},
    {"crc32c", ZarrPacking::crc32c, ""},
};

/// A little-endian number at the start of the bytes.
std::uint32_t zarrNumberAt(const std::byte* bytes) {
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | std::uint32_t(bytes[i]);
  return number;
}

// Each of these unpacks at most `most` bytes; none if the bytes are damaged or more.

/// Deflate with either header; several gzip members follow one another.
std::optional<ZarrBytes> inflateZarr(const ZarrBytes& packed, std::uint64_t most) {
  constexpr std::uint64_t kDeflateRatio = 1032;
  constexpr int kAnyHeader = 15 + 32;
  ZarrBytes bytes(std::min(most, saturatingProduct(packed.size(), kDeflateRatio)));
  z_stream stream{};
  if (::inflateInit2(&stream, kAnyHeader) != Z_OK) return std::nullopt;
  std::size_t used = 0, done = 0;
  int status = Z_OK;
  std::byte none{};
  do {
    const auto piece = [](std::size_t left) { return uInt(std::min<std::size_t>(left, 1u << 30)); };
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data() + used));
    stream.avail_in = piece(packed.size() - used);
    stream.next_out = reinterpret_cast<Bytef*>(bytes.empty() ? &none : bytes.data() + done);
    stream.avail_out = piece(bytes.size() - done);
    const uInt in = stream.avail_in, out = stream.avail_out;
    status = ::inflate(&stream, Z_NO_FLUSH);
    used += in - stream.avail_in;
    done += out - stream.avail_out;
    if (status == Z_STREAM_END && used < packed.size()) status = ::inflateReset(&stream);
  } while (status == Z_OK);
  ::inflateEnd(&stream);
  if (status != Z_STREAM_END) return std::nullopt;
  bytes.resize(done);
  return bytes;
}

#if SCOLOPAX_HAS_ZSTD
std::optional<ZarrBytes> unpackZstd(const ZarrBytes& packed, std::uint64_t most) {
  const auto told = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (told == ZSTD_CONTENTSIZE_ERROR || (told != ZSTD_CONTENTSIZE_UNKNOWN && told > most))
    return std::nullopt;
  ZarrBytes bytes(most);
  const std::size_t size = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(size)) return std::nullopt;
  bytes.resize(size);
  return bytes;
}
#endif

#if SCOLOPAX_HAS_BLOSC
std::optional<ZarrBytes> unpackBlosc(const ZarrBytes& packed, std::uint64_t most) {
  std::size_t size = 0;
  if (packed.size() < BLOSC_MIN_HEADER_LENGTH ||
      blosc_cbuffer_validate(packed.data(), packed.size(), &size) < 0 || size > most)
    return std::nullopt;
  ZarrBytes bytes(size);
  if (size > 0 && blosc_decompress_ctx(packed.data(), bytes.data(), size, 1) != int(size))
    return std::nullopt;
  return bytes;
}
#endif

#if SCOLOPAX_HAS_LZ4
/// As numcodecs writes it: the size in four bytes, then one block.
std::optional<ZarrBytes> unpackLz4(const ZarrBytes& packed, std::uint64_t most) {
  constexpr std::size_t kHeader = 4;
  if (packed.size() < kHeader || packed.size() > LZ4_MAX_INPUT_SIZE) return std::nullopt;
  const std::uint32_t size = zarrNumberAt(packed.data());
  if (size > most || size > LZ4_MAX_INPUT_SIZE) return std::nullopt;
  ZarrBytes bytes(size);
  const int got =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data() + kHeader),
                          reinterpret_cast<char*>(bytes.data()), int(packed.size() - kHeader), int(size));
  if (got != int(size)) return std::nullopt;
  return bytes;
}
#endif

/// Takes the checksum off the end.
std::optional<ZarrBytes> withoutCrc32c(ZarrBytes packed) {
  constexpr std::size_t kChecksum = 4;
  if (packed.size() < kChecksum) return std::nullopt;
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> checksum;
  checksum.process_bytes(packed.data(), packed.size() - kChecksum);
  if (checksum.checksum() != zarrNumberAt(packed.data() + packed.size() - kChecksum)) return std::nullopt;
  packed.resize(packed.size() - kChecksum);
  return packed;
}

std::optional<ZarrBytes> unpackOne(ZarrPacking packing, ZarrBytes packed, std::uint64_t most) {
  switch (packing) {
    case ZarrPacking::zlib:
    case ZarrPacking::gzip:
      return inflateZarr(packed, most);
#if SCOLOPAX_HAS_ZSTD
    case ZarrPacking::zstd:
      return unpackZstd(packed, most);
#endif
#if SCOLOPAX_HAS_BLOSC
    case ZarrPacking::blosc:
      return unpackBlosc(packed, most);
#endif
#if SCOLOPAX_HAS_LZ4
    case ZarrPacking::lz4:
      return unpackLz4(packed, most);
#endif
    case ZarrPacking::crc32c:
      return withoutCrc32c(std::move(packed));
    default:  // refused by zarrPackingFromName
      return std::nullopt;
  }
}

std::string_view nameOfPacking(ZarrPacking packing) {
  return std::ranges::find(kZarrPackings, packing, &ZarrPackingName::packing)->name;
}

}  // namespace

ZarrPacking zarrPackingFromName(const std::string& where, std::string_view name) {
  // What zarr-python calls the codecs of v2 in arrays of v3.
  constexpr std::string_view kNumcodecs = "numcodecs.";
  const std::string_view plain = name.starts_with(kNumcodecs) ? name.substr(kNumcodecs.size()) : name;
  const auto known = std::ranges::find(kZarrPackings, plain, &ZarrPackingName::name);
  if (known == std::end(kZarrPackings))
    throw Error(
        ErrorCode::unsupported,
        where + ": expected the codec zlib, gzip, zstd, blosc, lz4 or crc32c, found " + inQuotes(name));
  if (!known->lacks.empty())
    throw Error(ErrorCode::unsupported, where + ": " + std::string(known->name) + " needs the library of " +
                                            std::string(known->lacks) +
                                            ", without which this program was built");
  return known->packing;
}

std::uint64_t largestPackedZarrChunk(std::uint64_t size) {
  return saturatingSum(saturatingSum(size, size / 8), 1 << 16);
}

std::vector<std::byte> unpackZarrChunk(const std::string& where, std::vector<std::byte> packed,
                                       std::span<const ZarrPacking> packings, std::uint64_t size) {
  for (std::size_t i = packings.size(); i-- > 0;) {
    const std::uint64_t most = i == 0 ? size : largestPackedZarrChunk(size);
    auto bytes = unpackOne(packings[i], std::move(packed), most);
    if (!bytes)
      throw Error(ErrorCode::badInput, where + ": expected at most " + std::to_string(most) + " bytes of " +
                                           std::string(nameOfPacking(packings[i])) +
                                           ", found damaged data or more");
    packed = std::move(*bytes);
  }
  if (packed.size() != size)
    throw Error(ErrorCode::badInput, where + ": expected a chunk of " + std::to_string(size) +
                                         " bytes, found " + std::to_string(packed.size()));
  return packed;
}

}  // namespace scolopax::io
