// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/channel_names.h"

#include <algorithm>
#include <string_view>

namespace scolopax::io {
namespace {

bool endsWord(char c) { return std::string_view(" _-.:/").find(c) != std::string_view::npos; }

bool hasLetter(std::string_view text) {
  return std::ranges::any_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (static_cast<unsigned char>(c) & 0x80) != 0;
  });
}

/// Bytes that all names have in common at their beginning.
std::size_t commonPrefix(const std::vector<std::string>& names) {
  std::size_t length = names[0].size();
  for (const std::string& name : names)
    length = std::size_t(std::ranges::mismatch(name, names[0].substr(0, length)).in1 - name.begin());
  return length;
}

/// Drops the longest common beginning that ends with the end of a word and leaves every name a letter.
void dropCommonBeginning(std::vector<std::string>& names) {
  for (std::size_t length = commonPrefix(names); length > 0; --length) {
    if (!endsWord(names[0][length - 1])) continue;
    const bool enough =
        std::ranges::all_of(names, [&](const std::string& name) { return hasLetter(name.substr(length)); });
    if (!enough) continue;
    for (std::string& name : names) name.erase(0, length);
    return;
  }
}

}  // namespace

std::vector<std::string> shortNames(std::vector<std::string> names) {
  const bool several = std::ranges::any_of(names, [&](const std::string& name) { return name != names[0]; });
  if (!several) return names;
  dropCommonBeginning(names);
  // Once more from behind.
  for (std::string& name : names) std::ranges::reverse(name);
  dropCommonBeginning(names);
  for (std::string& name : names) std::ranges::reverse(name);
  return names;
}

}  // namespace scolopax::io
