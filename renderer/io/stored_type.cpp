// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/stored_type.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace scolopax::io {
namespace {

static_assert(std::endian::native == std::endian::little, "voxels are swapped to little-endian");

template <std::size_t N>
void reverseEach(std::byte* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) std::reverse(bytes + i * N, bytes + (i + 1) * N);
}

constexpr std::uint64_t kSaturated = std::numeric_limits<std::uint64_t>::max();

}  // namespace

std::size_t sizeBytes(StoredType type) {
  switch (type) {
#define X(name, numpyName, T) \
  case StoredType::name:      \
    return sizeof(T);
    SCOLOPAX_STORED_TYPES(X)
#undef X
  }
  return 0;
}

std::string_view nameOf(StoredType type) {
  switch (type) {
#define X(name, numpyName, T) \
  case StoredType::name:      \
    return numpyName;
    SCOLOPAX_STORED_TYPES(X)
#undef X
  }
  return "";
}

std::optional<StoredType> storedTypeFromName(std::string_view name) {
#define X(type, numpyName, T) \
  if (name == numpyName) return StoredType::type;
  SCOLOPAX_STORED_TYPES(X)
#undef X
  return std::nullopt;
}

std::optional<ScalarType> sameScalarType(StoredType type) {
  switch (type) {
    case StoredType::u8:
      return ScalarType::u8;
    case StoredType::u16:
      return ScalarType::u16;
    case StoredType::i16:
      return ScalarType::i16;
    case StoredType::f32:
      return ScalarType::f32;
    default:
      return std::nullopt;
  }
}

ScalarType largestKeptType(StoredType type) {
  return type == StoredType::i8 ? ScalarType::i16 : sameScalarType(type).value_or(ScalarType::f32);
}

std::string_view numpyNameOf(ScalarType type) {
  switch (type) {
    case ScalarType::u8:
      return nameOf(StoredType::u8);
    case ScalarType::u16:
      return nameOf(StoredType::u16);
    case ScalarType::i16:
      return nameOf(StoredType::i16);
    case ScalarType::f32:
      return nameOf(StoredType::f32);
  }
  return "";
}

float floatFromHalf(std::uint16_t bits) {
  const std::uint32_t sign = std::uint32_t(bits & 0x8000u) << 16;
  const std::uint32_t exponent = (bits >> 10) & 31u, mantissa = bits & 1023u;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7F800000u | (mantissa << 13));
  if (exponent == 0) return (sign ? -1.0f : 1.0f) * float(mantissa) * 0x1p-24f;
  return std::bit_cast<float>(sign | ((exponent + 112) << 23) | (mantissa << 13));
}

void swapBytes(std::byte* bytes, std::size_t count, std::size_t numberBytes) {
  if (numberBytes == 2) reverseEach<2>(bytes, count);
  if (numberBytes == 4) reverseEach<4>(bytes, count);
  if (numberBytes == 8) reverseEach<8>(bytes, count);
}

std::uint64_t saturatingProduct(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result;
  return __builtin_mul_overflow(a, b, &result) ? kSaturated : result;
}

std::uint64_t saturatingSum(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result;
  return __builtin_add_overflow(a, b, &result) ? kSaturated : result;
}

}  // namespace scolopax::io
