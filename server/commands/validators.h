// SPDX-License-Identifier: Apache-2.0
// Validators of options that CLI11 does not have: its own ranges accept NaN.
#pragma once
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <string>

namespace scolopax {

/// Accepts a number above 0 (with `zeroToo`, also 0) and up to `highest`.
inline CLI::Validator numberUpTo(double highest, bool zeroToo) {
  return {[highest, zeroToo](std::string& text) {
            double value = 0;
            const bool good = CLI::detail::lexical_cast(text, value) && value <= highest &&
                              (value > 0 || (zeroToo && value == 0));
            if (good) return std::string();
            return fmt::format("expected a number {} 0 and at most {:g}, found {}",
                               zeroToo ? "of at least" : "above", highest, text);
          },
          zeroToo ? "NONNEGATIVE" : "POSITIVE"};
}

}  // namespace scolopax
