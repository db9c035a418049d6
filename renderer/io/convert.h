// SPDX-License-Identifier: Apache-2.0
// Converts the bytes of a file to channels of the types that are kept in memory: byte order, interleaving,
// widening and narrowing. Between ByteStream and every loader's ChannelSource.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/format.h"

namespace scolopax::io {

/// Voxel types in files, by NumPy's names: one line per type with its C++ type (float16 as its bits).
#define SCOLOPAX_STORED_TYPES(X)   \
  X(i8, "int8", std::int8_t)       \
  X(u8, "uint8", std::uint8_t)     \
  X(i16, "int16", std::int16_t)    \
  X(u16, "uint16", std::uint16_t)  \
  X(i32, "int32", std::int32_t)    \
  X(u32, "uint32", std::uint32_t)  \
  X(i64, "int64", std::int64_t)    \
  X(u64, "uint64", std::uint64_t)  \
  X(f16, "float16", std::uint16_t) \
  X(f32, "float32", float)         \
  X(f64, "float64", double)

enum class StoredType {
#define X(name, numpyName, T) name,
  SCOLOPAX_STORED_TYPES(X)
#undef X
};
std::size_t sizeBytes(StoredType type);
std::string_view nameOf(StoredType type);
std::optional<StoredType> storedTypeFromName(std::string_view numpyName);

/// IEEE 754 binary16, exactly.
float floatFromHalf(std::uint16_t bits);

/// a * b and a + b, or the largest 64-bit number on overflow, so that false sizes stay too large.
std::uint64_t saturatingProduct(std::uint64_t a, std::uint64_t b);
std::uint64_t saturatingSum(std::uint64_t a, std::uint64_t b);

/// How voxels lie in a file.
struct VoxelLayout {
  StoredType type = StoredType::u8;
  bool bigEndian = false;
  glm::ivec3 dims{1};
  int channels = 1;
  bool interleaved = false;    ///< channels vary fastest; else each channel is a whole volume
  std::uint64_t gapBytes = 0;  ///< skipped between planar channels (later time steps)

  std::uint64_t voxelCount() const;
  /// From the first byte to the last one, gaps included; saturates.
  std::uint64_t sizeBytes() const;
  /// "13x7x3 uint16", with the number of channels if there are several.
  std::string description() const;
};

/// Dims from a header's numbers. `where` is file and field. Throws Error(badInput) unless each is at least 1,
/// Error(tooLarge) if one is beyond kMaxVolumeSide or their product beyond 2^48.
glm::ivec3 checkedDims(const std::string& where, std::int64_t x, std::int64_t y, std::int64_t z);

/// Throws Error(tooLarge) if the voxels, with the memory needed to convert them, exceed the limit, and
/// Error(unsupported) unless there are 1 to kMaxChannels channels. Allocates nothing.
void checkMemory(const std::string& file, const VoxelLayout& layout, std::uint64_t memoryLimitBytes);

/// Throws Error(badInput) if the file is too short for a `layout` that starts `offset` bytes into the stream,
/// even if its gzip data expand as far as deflate can. Allocates and reads nothing.
void checkFileHolds(const ByteStream& stream, const VoxelLayout& layout, std::uint64_t offset);

/// Makes both checks, skips to `offset` of the stream and reads the channels, without names.
std::vector<ChannelSource> readChannels(ByteStream& stream, std::uint64_t offset, const VoxelLayout& layout,
                                        std::uint64_t memoryLimitBytes, const Warn& warn);

/// Memory for `count` voxels as stored in a file: of their own type if that is kept, otherwise plain bytes.
VoxelBuffer makeStoredBuffer(StoredType type, std::size_t count);

/// Converts voxels, in a buffer of makeStoredBuffer in host byte order, to one of the kept types. i8 becomes
/// i16, f16 becomes f32, i32 and u32 become i16 or u16 if every value fits and otherwise f32, 64-bit types
/// become f32. Calls `warn` with what changed and what was lost.
VoxelBuffer toKeptType(StoredType type, VoxelBuffer stored, const std::string& file, const Warn& warn);

}  // namespace scolopax::io
