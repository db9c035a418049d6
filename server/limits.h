// SPDX-License-Identifier: Apache-2.0
// The limits of which clients are told: one list, from which the capabilities, the options of `serve` and the
// table in PROTOCOL.md are made. A new limit that the operator can choose is a line here and a member of
// Config, which has its default.
#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "server/config.h"

namespace scolopax::server {

struct Limit {
  std::string_view name;          ///< in the capabilities' `limits`
  std::string_view of;            ///< what is limited, with its unit
  std::string_view whenExceeded;  ///< HTTP status, or what happens instead
  /// The setting, or a number that is fixed.
  std::variant<std::uint64_t Config::*, double Config::*, std::uint64_t> value;
  std::string_view option = {};        ///< of `serve`, without the dashes; empty if the limit is fixed
  std::string_view defaultWords = {};  ///< the default, if it depends on the machine
};
std::span<const Limit> limits();

/// The capabilities' `limits`.
nlohmann::json limitsJson(const Config& config);
/// The table of PROTOCOL.md.
std::string limitsMarkdown();

}  // namespace scolopax::server
