// SPDX-License-Identifier: Apache-2.0
// The codecs of Zarr v2 and v3 that turn a chunk's bytes into other bytes: compression and checksums.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace scolopax::io {

enum class ZarrPacking { zlib, gzip, zstd, blosc, lz4, crc32c };

/// The codec of a name as documents write it, "blosc". `where` begins messages. Throws Error(unsupported) for
/// a name that is not known or whose library this build lacks.
ZarrPacking zarrPackingFromName(const std::string& where, std::string_view name);

/// Undoes the packings, the last first. The result has exactly `size` bytes, for which the caller has checked
/// memory. `where` begins messages. Throws Error(badInput) if the bytes are damaged, unpack to another size
/// or do not have their checksum.
std::vector<std::byte> unpackZarrChunk(const std::string& where, std::vector<std::byte> packed,
                                       std::span<const ZarrPacking> packings, std::uint64_t size);

/// The most bytes that a chunk of `size` bytes can have packed, with a margin for any encoder.
std::uint64_t largestPackedZarrChunk(std::uint64_t size);

}  // namespace scolopax::io
