// SPDX-License-Identifier: Apache-2.0
// Text from a stranger to JSON: the only way in, with the limits checked before anything is built.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace scolopax::protocol {

struct Limits {
  std::size_t bytes = std::size_t{1} << 20;
  std::size_t depth = 32;  ///< lists and objects within each other
};

/// Throws ProtocolError alone: 413 beyond `bytes`; 400 beyond `depth` or for what is not JSON in UTF-8 or
/// holds a number that no double can hold. Of two equal keys in an object the last counts.
nlohmann::json parseJson(std::string_view text, const Limits& limits = {});

}  // namespace scolopax::protocol
