// SPDX-License-Identifier: Apache-2.0
// Access control: one token per start of the server, presented in a header, a cookie or the URL. Checked
// before every request and upgrade, as net::Options::authorize.
#pragma once
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/message.h"

namespace scolopax {

/// The token file cannot be used, or no token can be created. The message says why and names the file.
class TokenError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// 256 random bits, encoded as 43 URL-safe characters. Throws TokenError if the system provides no random
/// numbers.
std::string createToken();
/// The line that the file consists of. Throws TokenError unless it has 16 to 512 characters: letters, digits
/// and -._~+/= (RFC 6750).
std::string readTokenFile(const std::string& path);
/// Compares in a time that depends only on the lengths of the texts.
bool sameToken(std::string_view a, std::string_view b);

/// A refusal as application/problem+json (RFC 9457).
net::Response problemResponse(int status, const std::string& detail);

/// Immutable and thread-safe.
class Authorizer {
 public:
  /// `loopback`: the server can be reached from this machine only. A Host header that names neither this
  /// machine nor an allowed origin (of a proxy) is then refused as DNS rebinding. `tls`: the cookie is sent
  /// over https only.
  Authorizer(std::string token, bool loopback, std::vector<std::string> allowedOrigins = {},
             bool tls = false);

  /// nullopt if the request may proceed. Otherwise the answer: 401, 403 or 421 or, to `GET /?token=`, a 303
  /// that sets the cookie.
  std::optional<net::Response> operator()(const net::Request& request) const;

  /// Whether the request carries the token, in any of the three ways.
  bool knows(const net::Request& request) const;

  const std::string& cookieName() const { return cookieName_; }

 private:
  bool isHostAllowed(const net::Request& request) const;
  bool hasBearer(const net::Request& request) const;
  bool hasQueryToken(const net::Request& request) const;
  bool hasCookie(const net::Request& request) const;
  net::Response cookieAndRedirect(const net::Request& request) const;

  std::string token_;
  std::string cookieName_;  ///< with a hash of the token, since cookies do not distinguish ports
  bool loopback_;
  std::vector<std::string> allowedOrigins_;
  bool tls_;
};

/// Whether a server bound to `host` (the value of the option) can be reached only from this machine.
bool isLoopback(std::string_view host);
/// The URL that opens the page, for the ready line. A wildcard address is replaced by 127.0.0.1.
std::string tokenUrl(std::string_view host, std::uint16_t port, std::string_view token, bool tls);

}  // namespace scolopax
