// SPDX-License-Identifier: Apache-2.0
#include "protocol/frame_header.h"

#include <bit>
#include <type_traits>

namespace scolopax::protocol {
namespace {

constexpr std::uint32_t kMagic = 0x584C4353;  // the bytes "SCLX"

/// The layout, shared by both directions: calls f(offset, value) for every field except magic and version.
template <class Header, class F>
void visitLayout(Header& h, F&& f) {
  f(6, h.headerBytes);
  f(8, h.codec);
  f(9, h.flags);
  f(10, h.width);
  f(12, h.height);
  f(14, h.method);
  f(16, h.frame);
  f(20, h.revision);
  f(24, h.patch);
  f(28, h.samples);
  f(32, h.error);
  f(36, h.rebuildUs);
  f(40, h.renderUs);
  f(44, h.encodeUs);
}

template <class T>
std::uint32_t bitsOf(T value) {
  if constexpr (std::is_same_v<T, float>)
    return std::bit_cast<std::uint32_t>(value);
  else
    return static_cast<std::uint32_t>(value);
}

template <class T>
T fromBits(std::uint32_t bits) {
  if constexpr (std::is_same_v<T, float>)
    return std::bit_cast<float>(bits);
  else
    return static_cast<T>(bits);
}

void put(std::span<std::byte> bytes, std::size_t offset, std::size_t size, std::uint32_t bits) {
  for (std::size_t i = 0; i < size; ++i) bytes[offset + i] = static_cast<std::byte>((bits >> (8 * i)) & 0xff);
}

std::uint32_t get(std::span<const std::byte> bytes, std::size_t offset, std::size_t size) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < size; ++i) bits |= std::to_integer<std::uint32_t>(bytes[offset + i]) << (8 * i);
  return bits;
}

}  // namespace

std::array<std::byte, kFrameHeaderBytes> encodeFrameHeader(const FrameHeader& header) {
  std::array<std::byte, kFrameHeaderBytes> bytes{};
  put(bytes, 0, 4, kMagic);
  put(bytes, 4, 2, kProtocolVersion);
  visitLayout(header, [&](std::size_t offset, const auto& value) {
    put(bytes, offset, sizeof(value), bitsOf(value));
  });
  put(bytes, 6, 2, kFrameHeaderBytes);
  return bytes;
}

std::optional<FrameHeader> decodeFrameHeader(std::span<const std::byte> message) {
  if (message.size() < kFrameHeaderBytes) return std::nullopt;
  if (get(message, 0, 4) != kMagic || get(message, 4, 2) != kProtocolVersion) return std::nullopt;
  FrameHeader header;
  visitLayout(header, [&](std::size_t offset, auto& value) {
    value = fromBits<std::remove_reference_t<decltype(value)>>(get(message, offset, sizeof(value)));
  });
  if (header.codec != Codec::jpeg && header.codec != Codec::png) return std::nullopt;
  if (header.headerBytes < kFrameHeaderBytes || header.headerBytes > message.size()) return std::nullopt;
  return header;
}

}  // namespace scolopax::protocol
