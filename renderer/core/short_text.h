// SPDX-License-Identifier: Apache-2.0
// Numbers for messages.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>

namespace scolopax {

/// Six significant digits, as %g; std::to_string would write out all digits of 1e308.
inline std::string shortText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// "3 MiB", rounded up.
inline std::string mebibytes(std::uint64_t bytes) {
  return std::to_string((bytes >> 20) + (bytes % (1 << 20) > 0)) + " MiB";
}

}  // namespace scolopax
