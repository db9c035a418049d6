// SPDX-License-Identifier: Apache-2.0
#include "protocol/json_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"

namespace scolopax::protocol {
namespace {

/// Maximum nesting of brackets outside strings. If the text is not JSON, this is at least the depth that a
/// parser reaches before it fails.
std::size_t nestingDepth(std::string_view text) {
  std::size_t depth = 0, deepest = 0;
  bool inString = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (inString) {
      if (c == '\\') ++i;
      if (c == '"') inString = false;
    } else if (c == '"') {
      inString = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return deepest;
}

}  // namespace

nlohmann::json parseJson(std::string_view text, const Limits& limits) {
  if (text.size() > limits.bytes) {
    throw ProtocolError(413, "",
                        "the document has " + std::to_string(text.size()) +
                            " bytes, more than the limit of " + std::to_string(limits.bytes) + " bytes");
  }
  if (nestingDepth(text) > limits.depth) {
    throw ProtocolError(400, "",
                        "lists and objects are nested more than " + std::to_string(limits.depth) + " deep");
  }
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw ProtocolError(400, "", "not valid JSON at byte " + std::to_string(error.byte));
  } catch (const nlohmann::json::exception&) {
    throw ProtocolError(400, "", "not valid JSON: a number is out of the range of a double");
  }
}

std::string jsonText(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace scolopax::protocol
