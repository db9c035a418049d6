// SPDX-License-Identifier: Apache-2.0
// The types that voxels have in files, and the types that they are kept as in memory.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "renderer/core/scalar_type.h"

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

/// The type in memory, if it is the stored one. Others are converted: i8 becomes i16, f16 becomes f32, i32
/// and u32 become i16 or u16 if every value fits and otherwise f32, 64-bit types become f32.
std::optional<ScalarType> sameScalarType(StoredType type);
/// The type in memory that takes the most bytes of those that the stored type can become.
ScalarType largestKeptType(StoredType type);
/// The NumPy name of a type in memory.
std::string_view numpyNameOf(ScalarType type);

/// IEEE 754 binary16, exactly.
float floatFromHalf(std::uint16_t bits);

/// Reverses the bytes of each of `count` numbers of `numberBytes` (1, 2, 4 or 8).
void swapBytes(std::byte* bytes, std::size_t count, std::size_t numberBytes);

/// a * b and a + b, or the largest 64-bit number on overflow, so that false sizes stay too large.
std::uint64_t saturatingProduct(std::uint64_t a, std::uint64_t b);
std::uint64_t saturatingSum(std::uint64_t a, std::uint64_t b);

}  // namespace scolopax::io
