// SPDX-License-Identifier: Apache-2.0
// The exception of the protocol, and its form on the wire (RFC 9457).
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace scolopax::protocol {

inline constexpr std::string_view kProblemType = "application/problem+json";

/// Untrusted text, shortened for a message: longer text is cut between two UTF-8 characters and ends with
/// "...", `most` bytes in all. To be used for every part of a request that a message quotes.
std::string shortened(std::string_view text, std::size_t most = 200);

/// A request or message that the server refuses. `what()` is the detail, one line that says what was expected
/// and what was found.
struct ProtocolError : std::runtime_error {
  /// Both texts are shortened, because they may quote long parts of a request.
  ProtocolError(int statusCode, std::string_view jsonPointer, std::string_view detail)
      : std::runtime_error(shortened(detail, kMaxDetail)),
        status(statusCode),
        pointer(shortened(jsonPointer, kMaxPointer)) {}
  static constexpr std::size_t kMaxDetail = 1000, kMaxPointer = 400;
  int status;  ///< HTTP status; from protocol/ itself 400 (not JSON), 413 (too large) or 422 (not a scene,
               ///< patch or message)
  std::string pointer;  ///< RFC 6901 pointer to the bad field; "" for the whole document
};

/// A limit that others have reached for now: "the limit of 8 `what` is reached; retry later".
ProtocolError limitReached(int status, std::uint64_t limit, std::string_view what);

/// The reason phrase of an HTTP status: "Unprocessable Content" for 422; "Error" for an unknown status.
std::string_view statusTitle(int status);

/// Body of type kProblemType with the members type, title, status, detail and, unless empty, pointer. Bytes
/// that are not UTF-8 are replaced, so that no `detail` makes this throw.
std::string problemJson(int status, std::string_view detail, std::string_view pointer = "");
std::string problemJson(const ProtocolError& error);

}  // namespace scolopax::protocol
