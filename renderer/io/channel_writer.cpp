// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/channel_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <glm/common.hpp>
#include <limits>
#include <type_traits>
#include <utility>

#include "renderer/core/error.h"

namespace scolopax::io {
namespace {

/// Voxels that are gathered and converted at a time.
constexpr std::size_t kBlock = 4096;

template <std::size_t N>
void gatherEach(std::byte* to, std::size_t count, const std::byte* from, std::ptrdiff_t stride) {
  for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * N, from + std::ptrdiff_t(i) * stride, N);
}

/// Copies `count` numbers, of which one begins every `stride` bytes, in the byte order of this machine.
void gather(std::byte* to, std::size_t count, const std::byte* from, std::ptrdiff_t stride, std::size_t bytes,
            bool bigEndian) {
  if (stride == std::ptrdiff_t(bytes)) {
    std::memcpy(to, from, count * bytes);
  } else {
    if (bytes == 1) gatherEach<1>(to, count, from, stride);
    if (bytes == 2) gatherEach<2>(to, count, from, stride);
    if (bytes == 4) gatherEach<4>(to, count, from, stride);
    if (bytes == 8) gatherEach<8>(to, count, from, stride);
  }
  if (bigEndian) swapBytes(to, count, bytes);
}

/// 32-bit integers begin as i16, in the hope that they fit.
ScalarType firstKeptType(StoredType type) {
  const bool narrows = type == StoredType::i32 || type == StoredType::u32;
  return narrows ? ScalarType::i16 : largestKeptType(type);
}

template <class T>
T valueAt(const std::byte* values, std::size_t i) {
  T value;
  std::memcpy(&value, values + i * sizeof(T), sizeof(T));
  return value;
}

}  // namespace

ChannelWriter::ChannelWriter(std::string file, StoredType type, glm::ivec3 dims, Loading& loading)
    : file_(std::move(file)),
      type_(type),
      dims_(dims),
      loading_(&loading),
      voxels_(firstKeptType(type), countOf(dims)),
      shared_(std::make_unique<Shared>()) {}

void ChannelWriter::write(std::size_t first, std::span<const std::byte> stored, bool bigEndian) {
  const std::size_t bytes = sizeBytes(type_);
  writeStrided(first, stored.size() / bytes, stored.data(), std::ptrdiff_t(bytes), bigEndian);
}

void ChannelWriter::writeStrided(std::size_t first, std::size_t count, const std::byte* stored,
                                 std::ptrdiff_t strideBytes, bool bigEndian) {
  if (first > voxels_.count() || count > voxels_.count() - first)
    throw Error(ErrorCode::badInput, file_ + ": expected " + std::to_string(voxels_.count()) +
                                         " voxels, found " + std::to_string(first) + " + " +
                                         std::to_string(count));
  put(first, count, stored, strideBytes, bigEndian);
  loading_->advance(count * sizeBytes(type_));
  const std::lock_guard lock(shared_->mutex);
  shared_->written += count;
}

void ChannelWriter::writeBox(const glm::ivec3& first, const glm::ivec3& size, const std::byte* stored,
                             const std::array<std::ptrdiff_t, 3>& strideBytes, bool bigEndian) {
  glm::i64vec3 begin(first), end = begin + glm::i64vec3(size);
  begin = glm::max(begin, glm::i64vec3(0));
  end = glm::min(end, glm::i64vec3(dims_));
  if (begin.x >= end.x || begin.y >= end.y || begin.z >= end.z) return;
  const auto width = std::size_t(end.x - begin.x);
  for (std::int64_t z = begin.z; z < end.z; ++z) {
    for (std::int64_t y = begin.y; y < end.y; ++y) {
      const glm::i64vec3 at = glm::i64vec3(begin.x, y, z) - glm::i64vec3(first);
      put(std::size_t((z * dims_.y + y) * dims_.x + begin.x), width,
          stored + at.x * strideBytes[0] + at.y * strideBytes[1] + at.z * strideBytes[2], strideBytes[0],
          bigEndian);
    }
  }
  const std::size_t count = width * std::size_t(end.y - begin.y) * std::size_t(end.z - begin.z);
  loading_->advance(count * sizeBytes(type_));
  const std::lock_guard lock(shared_->mutex);
  shared_->written += count;
}

void ChannelWriter::put(std::size_t first, std::size_t count, const std::byte* stored,
                        std::ptrdiff_t strideBytes, bool bigEndian) {
  const std::size_t bytes = sizeBytes(type_);
  if (sameScalarType(type_)) {
    gather(voxels_.data() + first * bytes, count, stored, strideBytes, bytes, bigEndian);
    return;
  }
  std::array<std::byte, kBlock * 8> values;
  for (std::size_t done = 0; done < count; done += kBlock) {
    const std::size_t some = std::min(kBlock, count - done);
    gather(values.data(), some, stored + std::ptrdiff_t(done) * strideBytes, strideBytes, bytes, bigEndian);
    convert(first + done, some, values.data());
  }
}

void ChannelWriter::convert(std::size_t first, std::size_t count, const std::byte* values) {
  switch (type_) {
    case StoredType::i8:
      return copy<std::int8_t, std::int16_t>(first, count, values,
                                             [](std::int8_t v) { return std::int16_t(v); });
    case StoredType::f16:
      return copy<std::uint16_t, float>(first, count, values, floatFromHalf);
    case StoredType::i32:
      return narrow<std::int32_t>(first, count, values);
    case StoredType::u32:
      return narrow<std::uint32_t>(first, count, values);
    case StoredType::i64:
      return round<std::int64_t>(first, count, values);
    case StoredType::u64:
      return round<std::uint64_t>(first, count, values);
    default:
      return round<double>(first, count, values);
  }
}

template <class From, class To>
void ChannelWriter::copy(std::size_t first, std::size_t count, const std::byte* values,
                         To (*convertOne)(From)) {
  const std::span<To> to = voxels_.as<To>().subspan(first, count);
  for (std::size_t i = 0; i < count; ++i) to[i] = convertOne(valueAt<From>(values, i));
}

template <class From>
void ChannelWriter::round(std::size_t first, std::size_t count, const std::byte* values) {
  using Wide = std::conditional_t<sizeof(From) == 8, long double, double>;  // holds any From exactly
  const std::span<float> to = voxels_.as<float>().subspan(first, count);
  Wide largest = 0;
  std::size_t infinite = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = valueAt<From>(values, i);
    const auto exact = static_cast<Wide>(value);
    to[i] = static_cast<float>(value);
    const Wide difference = std::abs(static_cast<Wide>(to[i]) - exact);
    if (!(difference > 0)) continue;  // exact; NaN and infinities stay what they are
    if (std::isinf(to[i]))
      ++infinite;
    else
      largest = std::max(largest, difference / std::abs(exact));
  }
  if (largest == 0 && infinite == 0) return;
  // narrow() calls this with the mutex held.
  std::unique_lock lock(shared_->mutex, std::defer_lock);
  if constexpr (sizeof(From) == 8) lock.lock();
  shared_->largestError = std::max(shared_->largestError, double(largest));
  shared_->infinite += infinite;
}

/// To i16 or u16 while every value fits, otherwise to float. One thread at a time, because the type may
/// change.
template <class From>
void ChannelWriter::narrow(std::size_t first, std::size_t count, const std::byte* values) {
  const std::lock_guard lock(shared_->mutex);
  if (voxels_.type() != ScalarType::f32) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t value = valueAt<From>(values, i);
      shared_->lowest = std::min(shared_->lowest, value);
      shared_->highest = std::max(shared_->highest, value);
    }
    const auto fits = [&]<class To>(To) {
      return std::in_range<To>(shared_->lowest) && std::in_range<To>(shared_->highest);
    };
    // What was written so far is not negative if u16 fits now: the bits stay.
    if (fits(std::int16_t{}))
      return copy<From, std::int16_t>(first, count, values,
                                      [](From v) { return static_cast<std::int16_t>(v); });
    if (fits(std::uint16_t{})) {
      voxels_ = std::move(voxels_).reinterpretedAs(ScalarType::u16);
      return copy<From, std::uint16_t>(first, count, values,
                                       [](From v) { return static_cast<std::uint16_t>(v); });
    }
    changeToFloat();
  }
  round<From>(first, count, values);
}

void ChannelWriter::changeToFloat() {
  VoxelBuffer floats(ScalarType::f32, voxels_.count());
  visitScalarType(voxels_.type(), [&](auto zero) {
    using From = decltype(zero);
    constexpr std::size_t kAtOnce = 1 << 20;
    const std::span<const From> from = std::as_const(voxels_).as<From>();
    for (std::size_t first = 0; first < from.size(); first += kAtOnce) {
      const std::size_t count = std::min(kAtOnce, from.size() - first);
      std::ranges::copy(from.subspan(first, count), floats.as<float>().subspan(first).data());
      voxels_.release(first, first + count);
    }
  });
  voxels_ = std::move(floats);
}

void ChannelWriter::fill(double value) {
  visitScalarType(voxels_.type(), [&](auto zero) {
    using T = decltype(zero);
    using Range = std::numeric_limits<T>;
    const double inRange =
        std::isnan(value) ? 0 : std::clamp(value, double(Range::lowest()), double(Range::max()));
    const T kept = std::is_same_v<T, float> ? T(value) : T(inRange);
    std::ranges::fill(voxels_.as<T>(), kept);
  });
  if (type_ == StoredType::i32 || type_ == StoredType::u32) {  // may not fit the first type
    const bool isSigned = type_ == StoredType::i32;
    const double lowest = isSigned ? -0x1p31 : 0, highest = isSigned ? 0x1p31 - 1 : 0x1p32 - 1;
    const auto whole = std::int64_t(std::isnan(value) ? 0 : std::clamp(value, lowest, highest));
    std::array<std::byte, 4> stored;
    std::memcpy(stored.data(), &whole, stored.size());
    put(0, voxels_.count(), stored.data(), 0, false);
  }
  loading_->checkStop();
  shared_->filled = true;
}

std::string ChannelWriter::loss() const {
  if (type_ == StoredType::i8 || type_ == StoredType::f16) return "no loss";
  if (voxels_.type() != ScalarType::f32) return "every value fits";
  char text[64];
  std::snprintf(text, sizeof text, "largest relative rounding error %.2g", shared_->largestError);
  std::string result = shared_->largestError > 0 ? text : "no rounding";
  if (shared_->infinite > 0)
    result +=
        ", " + std::to_string(shared_->infinite) + " values beyond the range of float32 became infinite";
  return result;
}

VoxelBuffer ChannelWriter::take() {
  if (!shared_->filled && shared_->written < voxels_.count())
    throw Error(ErrorCode::badInput, file_ + ": expected " + std::to_string(voxels_.count()) +
                                         " voxels, found " + std::to_string(shared_->written));
  if (!sameScalarType(type_))
    loading_->warn(file_ + ": " + std::string(nameOf(type_)) + " voxels are kept as " +
                   std::string(numpyNameOf(voxels_.type())) + " (" + loss() + ")");
  return std::move(voxels_);
}

std::vector<VoxelBuffer> takeAll(std::vector<ChannelWriter>& writers) {
  std::vector<VoxelBuffer> all;
  all.reserve(writers.size());
  for (ChannelWriter& writer : writers) all.push_back(writer.take());
  return all;
}

}  // namespace scolopax::io
