// SPDX-License-Identifier: Apache-2.0
#include "server/net/client_address.h"

#include <arpa/inet.h>

#include <algorithm>

#include "server/net/url.h"

namespace scolopax::net {

std::optional<std::string> usualAddress(const std::string& text) {
  char usual[INET6_ADDRSTRLEN];
  in_addr four{};
  in6_addr six{};
  if (inet_pton(AF_INET, text.c_str(), &four) == 1) return inet_ntop(AF_INET, &four, usual, sizeof usual);
  if (inet_pton(AF_INET6, text.c_str(), &six) != 1) return std::nullopt;
  if (IN6_IS_ADDR_V4MAPPED(&six)) return inet_ntop(AF_INET, &six.s6_addr[12], usual, sizeof usual);
  return inet_ntop(AF_INET6, &six, usual, sizeof usual);
}

std::string clientAddress(const Headers& headers, const std::string& peer,
                          const std::vector<std::string>& trustedProxies) {
  const auto trusted = [&](const std::string& address) {
    return std::find(trustedProxies.begin(), trustedProxies.end(), address) != trustedProxies.end();
  };
  if (!trusted(peer)) return peer;
  const auto [begin, end] = headers.equal_range("X-Forwarded-For");
  for (auto header = end; header != begin;) {
    std::string_view rest = (--header)->second;  // of several headers, the later ones continue the list
    for (;;) {
      const std::size_t comma = rest.rfind(',');
      const bool first = comma == std::string_view::npos;
      const auto address = usualAddress(std::string(trimmed(first ? rest : rest.substr(comma + 1))));
      if (!address) return peer;
      if (!trusted(*address)) return *address;
      if (first) break;
      rest = rest.substr(0, comma);
    }
  }
  return peer;
}

}  // namespace scolopax::net
