// SPDX-License-Identifier: Apache-2.0
// Reads and writes JSON text. All JSON from clients passes through here; limits are checked before it is
// parsed.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace scolopax::protocol {

struct Limits {
  std::size_t bytes = std::size_t{1} << 20;
  std::size_t depth = 32;  ///< maximum nesting of lists and objects
};

/// Throws only ProtocolError: 413 for more than `bytes` bytes; 400 for nesting deeper than `depth`, for text
/// that is not JSON in UTF-8, and for a number outside the range of a double. If an object repeats a key, the
/// last value is used.
nlohmann::json parseJson(std::string_view text, const Limits& limits = {});
/// Compact text. Bytes that are not UTF-8 are replaced.
std::string jsonText(const nlohmann::json& json);

}  // namespace scolopax::protocol
