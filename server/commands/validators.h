// SPDX-License-Identifier: Apache-2.0
// Checks of options that CLI11's own leave open: its ranges let NaN pass.
#pragma once
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <string>

namespace scolopax {

/// A number up to `highest`, above zero or, with `zeroToo`, from it.
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
