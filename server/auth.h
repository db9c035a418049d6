// SPDX-License-Identifier: Apache-2.0
// Who may use the server: one token per start, shown by header, cookie or URL. Put before every request and
// upgrade as net::Options::authorize.
#pragma once
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/message.h"

namespace scolopax {

/// A token file that cannot be used: the message names it and says why.
class TokenError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// 256 random bits as 43 URL-safe characters.
std::string createToken();
/// The file's one line; throws TokenError unless it is 16 to 512 letters, digits and -._~+/= (RFC 6750).
std::string readTokenFile(const std::string& path);
/// In a time that depends on the lengths alone.
bool sameToken(std::string_view a, std::string_view b);

/// A refusal as application/problem+json (RFC 9457).
net::Response problemResponse(int status, const std::string& detail);

/// Immutable and thread-safe.
class Authorizer {
 public:
  /// `loopback`: the server is bound to this machine only, so that a Host that is neither this machine nor
  /// that of an allowed origin (a proxy in front) is DNS rebinding. `tls`: the cookie travels over nothing
  /// else.
  Authorizer(std::string token, bool loopback, std::vector<std::string> allowedOrigins = {},
             bool tls = false);

  /// nullopt: go on. Otherwise 401, 403, 421, or the 303 that turns `GET /?token=` into a cookie.
  std::optional<net::Response> operator()(const net::Request& request) const;

  /// Whether the request shows the token, in whatever way.
  bool knows(const net::Request& request) const;

  const std::string& cookieName() const { return cookieName_; }

 private:
  bool isHostAllowed(const net::Request& request) const;
  bool hasBearer(const net::Request& request) const;
  bool hasQueryToken(const net::Request& request) const;
  bool hasCookie(const net::Request& request) const;
  net::Response cookieAndRedirect(const net::Request& request) const;

  std::string token_;
  std::string cookieName_;  ///< cookies ignore ports: a hash of the token keeps two servers apart
  bool loopback_;
  std::vector<std::string> allowedOrigins_;
  bool tls_;
};

/// Whether `host` (an option's value) can be reached from this machine only.
bool isLoopback(std::string_view host);
/// The URL that opens the page, for the ready line; a wildcard address becomes this machine's own.
std::string tokenUrl(std::string_view host, std::uint16_t port, std::string_view token, bool tls);

}  // namespace scolopax
