// SPDX-License-Identifier: Apache-2.0
// Numbers in messages.
#pragma once
#include <cstdio>
#include <string>

namespace scolopax {

/// Six digits, as %g: std::to_string spells 1e308 out.
inline std::string shortText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace scolopax
