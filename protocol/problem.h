// SPDX-License-Identifier: Apache-2.0
// The protocol's one exception, and its form on the wire (RFC 9457).
#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace scolopax::protocol {

inline constexpr std::string_view kProblemType = "application/problem+json";

/// A stranger's text for a message: no longer than `most` bytes, cut between two characters of UTF-8. Every
/// text of a request that a detail repeats goes through this.
std::string shortened(std::string_view text, std::size_t most = 200);

/// What a client did wrong. `what()` is the detail: one line with what was expected and what was found.
struct ProtocolError : std::runtime_error {
  /// Both texts are cut: what they echo of a client's request may be as long as it.
  ProtocolError(int statusCode, std::string_view jsonPointer, std::string_view detail)
      : std::runtime_error(shortened(detail, kMostDetail)),
        status(statusCode),
        pointer(shortened(jsonPointer, kMostPointer)) {}
  static constexpr std::size_t kMostDetail = 1000, kMostPointer = 400;
  int status;           ///< HTTP status: 400 not JSON, 413 too large, 422 not a scene, patch or message
  std::string pointer;  ///< RFC 6901 pointer to the bad field; "" for the whole document
};

/// The phrase that belongs to an HTTP status: "Unprocessable Content".
std::string_view statusTitle(int status);

/// Body of kProblemType; members type, title, status, detail and, where it is not "", pointer.
/// Bytes that are not UTF-8 are replaced: this never throws because of what `detail` holds.
std::string problemJson(int status, std::string_view detail, std::string_view pointer = "");
std::string problemJson(const ProtocolError& error);

}  // namespace scolopax::protocol
