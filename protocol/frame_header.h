// SPDX-License-Identifier: Apache-2.0
// The header before the image bytes of a binary WebSocket message; offsets are in PROTOCOL.md.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace scolopax::protocol {

inline constexpr std::size_t kFrameHeaderBytes = 48;
inline constexpr std::uint16_t kProtocolVersion = 1;

enum class Codec : std::uint8_t { jpeg = 1, png = 2 };
inline constexpr std::uint8_t kFlagInteractive = 1;  ///< lower resolution or quality while edits arrive
inline constexpr std::uint8_t kFlagFinal = 2;  ///< the stop condition is met: no frame follows until an edit

struct FrameHeader {
  std::uint16_t headerBytes = kFrameHeaderBytes;  ///< the image starts here
  Codec codec = Codec::jpeg;
  std::uint8_t flags = 0;
  std::uint16_t width = 0, height = 0;  ///< of the encoded image, pixels
  std::uint8_t method = 0;              ///< 1 + index in the capabilities' `methods`; 0: not given
  std::uint32_t frame = 0;              ///< counts up from 1 per connection; `ack` refers to it
  std::uint32_t revision = 0;           ///< of the scene that the whole image shows
  std::uint32_t patch = 0;              ///< id of this client's last patch that the image includes; 0: none
  std::uint32_t samples = 0;            ///< per pixel
  float error = 0;                      ///< estimated RMSE, linear RGBA; NaN below two samples
  std::uint32_t rebuildUs = 0, renderUs = 0, encodeUs = 0;
  bool operator==(const FrameHeader&) const = default;
};

/// Little-endian on every machine. headerBytes is written as kFrameHeaderBytes.
std::array<std::byte, kFrameHeaderBytes> encodeFrameHeader(const FrameHeader& header);

/// Reads the header at the start of a message. nullopt if the magic or version differs, if the codec is
/// unknown, if headerBytes is less than 48, or if the message is shorter than 48 bytes or than headerBytes.
std::optional<FrameHeader> decodeFrameHeader(std::span<const std::byte> message);

}  // namespace scolopax::protocol
