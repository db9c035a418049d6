// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/convert.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <set>
#include <type_traits>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::uint64_t kSaturated = std::numeric_limits<std::uint64_t>::max();
static_assert(std::endian::native == std::endian::little, "voxels are swapped to little-endian");

std::optional<ScalarType> keptType(StoredType type) {
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

template <std::size_t N>
void reverseEach(std::byte* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) std::reverse(bytes + i * N, bytes + (i + 1) * N);
}

void swapBytes(std::byte* bytes, std::size_t count, std::size_t elementBytes) {
  if (elementBytes == 2) reverseEach<2>(bytes, count);
  if (elementBytes == 4) reverseEach<4>(bytes, count);
  if (elementBytes == 8) reverseEach<8>(bytes, count);
}

template <class From, class To>
VoxelBuffer widened(const VoxelBuffer& stored, To (*convert)(From)) {
  const std::size_t count = stored.sizeBytes() / sizeof(From);
  const From* from = reinterpret_cast<const From*>(stored.data());
  VoxelBuffer result(scalarTypeOf<To>, count);
  std::transform(from, from + count, result.as<To>().data(), convert);
  return result;
}

/// Converts to float; `loss` tells the largest relative rounding error and how many values became infinite.
template <class From>
VoxelBuffer rounded(const VoxelBuffer& stored, std::string& loss) {
  using Wide = std::conditional_t<sizeof(From) == 8, long double, double>;  // holds any From exactly
  const std::size_t count = stored.sizeBytes() / sizeof(From);
  const From* from = reinterpret_cast<const From*>(stored.data());
  VoxelBuffer result(ScalarType::f32, count);
  const std::span<float> to = result.as<float>();
  Wide largest = 0;
  std::size_t infinite = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto exact = static_cast<Wide>(from[i]);
    to[i] = static_cast<float>(from[i]);
    const Wide difference = std::abs(static_cast<Wide>(to[i]) - exact);
    if (!(difference > 0)) continue;  // exact; NaN and infinities stay what they are
    if (std::isinf(to[i]))
      ++infinite;
    else
      largest = std::max(largest, difference / std::abs(exact));
  }
  char text[64];
  std::snprintf(text, sizeof text, "largest relative rounding error %.2g", double(largest));
  loss = largest > 0 ? text : "no rounding";
  if (infinite > 0)
    loss += ", " + std::to_string(infinite) + " values beyond the range of float32 became infinite";
  return result;
}

/// To i16 or u16 if every value fits, otherwise to float.
template <class From>
VoxelBuffer narrowed(const VoxelBuffer& stored, std::string& loss) {
  const std::size_t count = stored.sizeBytes() / sizeof(From);
  const From* from = reinterpret_cast<const From*>(stored.data());
  const auto range = std::minmax_element(from, from + count);
  const auto fits = [&]<class To>(To) {
    return std::in_range<To>(*range.first) && std::in_range<To>(*range.second);
  };
  loss = "every value fits";
  if (fits(std::int16_t{})) {
    return widened<From, std::int16_t>(stored, [](From value) { return static_cast<std::int16_t>(value); });
  }
  if (fits(std::uint16_t{})) {
    return widened<From, std::uint16_t>(stored, [](From value) { return static_cast<std::uint16_t>(value); });
  }
  return rounded<From>(stored, loss);
}

std::string_view numpyName(ScalarType type) {
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

std::string asText(std::uint64_t bytes) {
  return bytes == kSaturated ? "more than 2^64 bytes" : std::to_string(bytes) + " bytes";
}

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

float floatFromHalf(std::uint16_t bits) {
  const std::uint32_t sign = std::uint32_t(bits & 0x8000u) << 16;
  const std::uint32_t exponent = (bits >> 10) & 31u, mantissa = bits & 1023u;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7F800000u | (mantissa << 13));
  if (exponent == 0) return (sign ? -1.0f : 1.0f) * float(mantissa) * 0x1p-24f;
  return std::bit_cast<float>(sign | ((exponent + 112) << 23) | (mantissa << 13));
}

std::uint64_t saturatingProduct(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result;
  return __builtin_mul_overflow(a, b, &result) ? kSaturated : result;
}

std::uint64_t saturatingSum(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result;
  return __builtin_add_overflow(a, b, &result) ? kSaturated : result;
}

std::uint64_t VoxelLayout::voxelCount() const {
  return std::uint64_t(dims.x) * std::uint64_t(dims.y) * std::uint64_t(dims.z);
}

std::uint64_t VoxelLayout::sizeBytes() const {
  const auto channelCount = std::uint64_t(channels);
  const std::uint64_t voxels = saturatingProduct(voxelCount(), channelCount * io::sizeBytes(type));
  return saturatingSum(voxels, saturatingProduct(gapBytes, channelCount - 1));
}

std::string VoxelLayout::description() const {
  std::string text = std::to_string(dims.x) + "x" + std::to_string(dims.y) + "x" + std::to_string(dims.z) +
                     " " + std::string(nameOf(type));
  if (channels > 1) text += ", " + std::to_string(channels) + " channels";
  return text;
}

glm::ivec3 checkedDims(const std::string& where, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::string found =
      "found " + std::to_string(x) + " x " + std::to_string(y) + " x " + std::to_string(z);
  if (x < 1 || y < 1 || z < 1)
    throw Error(ErrorCode::badInput, where + ": expected sizes of at least 1, " + found);
  const bool fits = x <= kMaxVolumeSide && y <= kMaxVolumeSide && z <= kMaxVolumeSide &&
                    saturatingProduct(std::uint64_t(x) * std::uint64_t(y), std::uint64_t(z)) <= 1ull << 48;
  if (!fits)
    throw Error(ErrorCode::tooLarge,
                where + ": expected at most 2^48 voxels and 2^24 along an axis, " + found);
  return glm::ivec3(int(x), int(y), int(z));
}

void checkMemory(const std::string& file, const VoxelLayout& layout, std::uint64_t memoryLimitBytes) {
  if (layout.channels < 1 || layout.channels > kMaxChannels) {
    throw Error(ErrorCode::unsupported, file + ": expected 1 to " + std::to_string(kMaxChannels) +
                                            " channels, found " + std::to_string(layout.channels));
  }
  const std::uint64_t count = layout.voxelCount(), stored = sizeBytes(layout.type);
  const auto channels = std::uint64_t(layout.channels);
  std::uint64_t bytesPerVoxel = stored * channels;
  if (!keptType(layout.type)) {
    const std::uint64_t result = layout.type == StoredType::i8 ? 2 : 4;
    bytesPerVoxel = result * channels + stored * (layout.interleaved ? channels : 1);
  }
  const std::uint64_t needed = saturatingProduct(count, bytesPerVoxel);
  if (needed <= memoryLimitBytes) return;
  throw Error(ErrorCode::tooLarge, file + ": " + layout.description() + " needs " + asText(needed) +
                                       " of memory, the limit is " + asText(memoryLimitBytes));
}

void checkFileHolds(const ByteStream& stream, const VoxelLayout& layout, std::uint64_t offset) {
  const std::uint64_t needed = saturatingSum(offset, layout.sizeBytes());
  if (needed <= stream.largestSize()) return;
  throw Error(ErrorCode::badInput, shown(stream.path()) + ": " + layout.description() + " at byte " +
                                       std::to_string(offset) + " needs " + asText(needed) +
                                       ", the file holds " + (stream.compressed() ? "at most " : "") +
                                       asText(stream.largestSize()));
}

VoxelBuffer makeStoredBuffer(StoredType type, std::size_t count) {
  if (const auto kept = keptType(type)) return VoxelBuffer(*kept, count);
  return VoxelBuffer(ScalarType::u8, count * sizeBytes(type));
}

VoxelBuffer toKeptType(StoredType type, VoxelBuffer stored, const std::string& file, const Warn& warn) {
  if (keptType(type)) return stored;
  std::string loss = "no loss";
  VoxelBuffer result = [&] {
    switch (type) {
      case StoredType::i8:
        return widened<std::int8_t, std::int16_t>(stored, [](std::int8_t v) { return std::int16_t(v); });
      case StoredType::f16:
        return widened<std::uint16_t, float>(stored, floatFromHalf);
      case StoredType::i32:
        return narrowed<std::int32_t>(stored, loss);
      case StoredType::u32:
        return narrowed<std::uint32_t>(stored, loss);
      case StoredType::i64:
        return rounded<std::int64_t>(stored, loss);
      case StoredType::u64:
        return rounded<std::uint64_t>(stored, loss);
      default:
        return rounded<double>(stored, loss);
    }
  }();
  if (warn) {
    warn(file + ": " + std::string(nameOf(type)) + " voxels are kept as " +
         std::string(numpyName(result.type())) + " (" + loss + ")");
  }
  return result;
}

std::vector<ChannelSource> readChannels(ByteStream& stream, std::uint64_t offset, const VoxelLayout& layout,
                                        std::uint64_t memoryLimitBytes, const Warn& warn) {
  const std::string file = shown(stream.path());
  checkMemory(file, layout, memoryLimitBytes);
  checkFileHolds(stream, layout, offset);
  stream.skip(offset - stream.position());

  const auto count = std::size_t(layout.voxelCount());
  const auto channels = std::size_t(layout.channels);
  const std::size_t elementBytes = sizeBytes(layout.type);
  std::set<std::string> said;  // channels of one file tend to give the same warnings
  const Warn warnOnce = [&](const std::string& text) {
    if (warn && said.insert(text).second) warn(text);
  };
  std::vector<ChannelSource> result(channels);
  const auto keep = [&](ChannelSource& channel, VoxelBuffer stored) {
    if (layout.bigEndian) swapBytes(stored.data(), count, elementBytes);
    channel.voxels = toKeptType(layout.type, std::move(stored), file, warnOnce);
  };

  if (!layout.interleaved || channels == 1) {
    for (std::size_t c = 0; c < channels; ++c) {
      if (c > 0) stream.skip(layout.gapBytes);
      VoxelBuffer stored = makeStoredBuffer(layout.type, count);
      stream.read({stored.data(), count * elementBytes});
      keep(result[c], std::move(stored));
    }
    return result;
  }

  std::vector<VoxelBuffer> stored;
  for (std::size_t c = 0; c < channels; ++c) stored.push_back(makeStoredBuffer(layout.type, count));
  constexpr std::size_t kVoxelsAtOnce = 1 << 14;
  std::vector<std::byte> mixed(std::min(count, kVoxelsAtOnce) * channels * elementBytes);
  for (std::size_t first = 0; first < count; first += kVoxelsAtOnce) {
    const std::size_t voxels = std::min(kVoxelsAtOnce, count - first);
    stream.read(std::span(mixed).first(voxels * channels * elementBytes));
    for (std::size_t c = 0; c < channels; ++c) {
      std::byte* to = stored[c].data() + first * elementBytes;
      for (std::size_t i = 0; i < voxels; ++i) {
        std::memcpy(to + i * elementBytes, &mixed[(i * channels + c) * elementBytes], elementBytes);
      }
    }
  }
  for (std::size_t c = 0; c < channels; ++c) keep(result[c], std::move(stored[c]));
  return result;
}

}  // namespace scolopax::io
