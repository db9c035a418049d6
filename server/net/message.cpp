// SPDX-License-Identifier: Apache-2.0
#include "server/net/message.h"

#include <algorithm>

namespace scolopax::net {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

template <typename Map>
const std::string* firstOf(const Map& map, std::string_view name) {
  auto found = map.lower_bound(name);
  return found != map.end() && !map.key_comp()(name, found->first) ? &found->second : nullptr;
}

}  // namespace

bool NameLess::operator()(std::string_view a, std::string_view b) const {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                      [](char x, char y) { return lower(x) < lower(y); });
}

const std::string* Request::header(std::string_view name) const { return firstOf(headers, name); }
const std::string* Request::queryValue(std::string_view name) const { return firstOf(query, name); }

}  // namespace scolopax::net
