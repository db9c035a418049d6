// SPDX-License-Identifier: Apache-2.0
// Decodes and compares request targets, origins and header values.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/message.h"

namespace scolopax::net {

/// nullopt if a "%" is not followed by two hex digits, or if the result would contain a NUL.
std::optional<std::string> percentDecode(std::string_view text, bool plusIsSpace);
/// Everything but unreserved characters and "/" (RFC 3986) becomes %XX.
std::string percentEncodePath(std::string_view path);

struct Target {
  std::string path;
  Query query;
};
/// Origin form only ("/path?query"); nullopt for anything else or for bad encoding.
std::optional<Target> parseTarget(std::string_view target);

/// The value of a Host header, or the part of an origin after its scheme.
struct Authority {
  std::string_view host;  ///< a name or IPv4 address, or "[...]" with an IPv6 address
  std::optional<std::uint16_t> port;
};
/// nullopt for anything but a host and an optional port (RFC 3986, 3.2.2): no user, no path.
std::optional<Authority> parseAuthority(std::string_view text);

/// Whether an Origin header names the host that the request was sent to. Both http and https match, because a
/// proxy may add TLS. False for "null" and other schemes.
bool sameOrigin(std::string_view origin, std::string_view host);
/// Whether an upgrade is allowed: it has no Origin (not a browser), the server's own, or one of `allowed`.
bool originAllowed(const Request& request, const std::vector<std::string>& allowed);

/// The text without spaces and tabs around it.
std::string_view trimmed(std::string_view text);
/// Ignores the case of ASCII letters only.
bool equalIgnoringCase(std::string_view a, std::string_view b);

}  // namespace scolopax::net
