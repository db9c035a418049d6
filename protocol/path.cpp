// SPDX-License-Identifier: Apache-2.0
#include "protocol/path.h"

#include <nlohmann/json.hpp>

#include "protocol/problem.h"

namespace scolopax::protocol {
namespace {

/// Describes what was found, on one short line.
std::string describe(const nlohmann::json& found) {
  if (found.is_object()) return "an object";
  if (found.is_array()) return "a list of " + std::to_string(found.size());
  constexpr std::size_t kLongest = 60;
  std::string text =
      found.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);  // ASCII: safe to cut
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

}  // namespace

std::string Path::pointer() const {
  if (parent_ == nullptr) return "";
  std::string text = parent_->pointer() + '/';
  if (index_) return text + std::to_string(*index_);
  for (const char c : shortened(key_)) {
    if (c == '~')
      text += "~0";
    else if (c == '/')
      text += "~1";
    else
      text += c;
  }
  return text;
}

void failExpected(const Path& path, std::string_view expected, const nlohmann::json& found) {
  fail(path, "expected " + std::string(expected) + ", found " + describe(found));
}

void fail(const Path& path, std::string_view message) {
  const std::string pointer = path.pointer();
  throw ProtocolError(422, pointer,
                      (pointer.empty() ? "the document" : pointer) + ": " + std::string(message));
}

}  // namespace scolopax::protocol
