// SPDX-License-Identifier: Apache-2.0
// The protocol's one exception, and its form on the wire (RFC 9457).
#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace scolopax::protocol {

inline constexpr std::string_view kProblemType = "application/problem+json";

/// Untrusted text made fit for a message: at most `most` bytes, cut between two UTF-8 characters and ended by
/// "..." if it is longer. Every part of a request that a detail quotes goes through this.
std::string shortened(std::string_view text, std::size_t most = 200);

/// A request or message that the server refuses. `what()` is the detail: one line with what was expected and
/// what was found.
struct ProtocolError : std::runtime_error {
  /// Both texts are shortened: they may quote parts of a request, which can be long.
  ProtocolError(int statusCode, std::string_view jsonPointer, std::string_view detail)
      : std::runtime_error(shortened(detail, kMaxDetail)),
        status(statusCode),
        pointer(shortened(jsonPointer, kMaxPointer)) {}
  static constexpr std::size_t kMaxDetail = 1000, kMaxPointer = 400;
  int status;  ///< HTTP status; from protocol/ itself 400 (not JSON), 413 (too large) or 422 (not a scene,
               ///< patch or message)
  std::string pointer;  ///< RFC 6901 pointer to the bad field; "" for the whole document
};

/// The reason phrase of an HTTP status: "Unprocessable Content" for 422; "Error" for an unknown status.
std::string_view statusTitle(int status);

/// Body of type kProblemType with the members type, title, status, detail and, unless empty, pointer. Bytes
/// that are not UTF-8 are replaced, so whatever `detail` holds, this does not throw because of it.
std::string problemJson(int status, std::string_view detail, std::string_view pointer = "");
std::string problemJson(const ProtocolError& error);

}  // namespace scolopax::protocol
