// SPDX-License-Identifier: Apache-2.0
#include "server/auth.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include "protocol/problem.h"
#include "server/net/url.h"

namespace scolopax {
namespace {

constexpr std::size_t kTokenBytes = 32;
constexpr std::size_t kTokenMin = 16;
constexpr std::size_t kTokenMax = 512;

/// RFC 6750's b64token: characters that both a Bearer header and a cookie can carry.
bool isTokenCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("-._~+/=").find(c) != std::string_view::npos;
}

/// An IPv4 loopback address; false for a name that begins like one.
bool isLoopbackAddress(std::string_view host) {
  return host.substr(0, 4) == "127." && host.find_first_not_of("0123456789.") == std::string_view::npos;
}

}  // namespace

std::string createToken() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw TokenError("cannot create a token: the system provides no random numbers");
  }
  // Base64url (RFC 4648, 5): six bits per character; the last two bytes fill three characters.
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string token;
  unsigned bits = 0;
  int count = 0;
  for (const unsigned char byte : bytes) {
    bits = bits << 8 | byte;
    for (count += 8; count >= 6; count -= 6) token += kDigits[bits >> (count - 6) & 63];
    bits &= (1U << count) - 1;
  }
  if (count > 0) token += kDigits[bits << (6 - count) & 63];
  return token;
}

std::string readTokenFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(kTokenMax + 3, '\0');
  if (in) in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in.is_open() || in.bad()) throw TokenError("token file " + path + ": cannot be read");
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (!text.empty() && text.back() == '\n') text.pop_back();
  if (!text.empty() && text.back() == '\r') text.pop_back();
  if (text.size() < kTokenMin || text.size() > kTokenMax) {
    throw TokenError("token file " + path + ": expected one line of " + std::to_string(kTokenMin) + " to " +
                     std::to_string(kTokenMax) + " characters, found " +
                     (text.size() > kTokenMax ? "more" : std::to_string(text.size())));
  }
  if (!std::all_of(text.begin(), text.end(), isTokenCharacter)) {
    throw TokenError("token file " + path + ": expected letters, digits and -._~+/= only, on one line");
  }
  return text;
}

bool sameToken(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

net::Response problemResponse(int status, const std::string& detail) {
  return {status, std::string(protocol::kProblemType), protocol::problemJson(status, detail), {}};
}

Authorizer::Authorizer(std::string token, bool loopback, std::vector<std::string> allowedOrigins, bool tls)
    : token_(std::move(token)),
      cookieName_("scolopax-"),
      loopback_(loopback),
      allowedOrigins_(std::move(allowedOrigins)),
      tls_(tls) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(token_.data()), token_.size(), digest.data());
  for (int i = 0; i < 4; ++i) {
    cookieName_ += "0123456789abcdef"[digest[static_cast<std::size_t>(i)] >> 4];
    cookieName_ += "0123456789abcdef"[digest[static_cast<std::size_t>(i)] & 15];
  }
}

bool Authorizer::isHostAllowed(const net::Request& request) const {
  const std::string* host = request.header("Host");
  if (!loopback_ || !host) return true;  // no browser sends HTTP/1.0 without Host
  const auto authority = net::parseAuthority(*host);
  if (authority && isLoopback(authority->host)) return true;
  return std::any_of(allowedOrigins_.begin(), allowedOrigins_.end(),
                     [&](const std::string& origin) { return net::sameOrigin(origin, *host); });
}

bool Authorizer::hasBearer(const net::Request& request) const {
  const std::string* header = request.header("Authorization");
  if (!header) return false;
  const std::string_view text = *header;
  const std::size_t space = text.find(' ');
  return space != std::string_view::npos && net::equalIgnoringCase(text.substr(0, space), "Bearer") &&
         sameToken(net::trimmed(text.substr(space)), token_);
}

bool Authorizer::hasQueryToken(const net::Request& request) const {
  const std::string* token = request.queryValue("token");
  return token && (request.method == "GET" || request.method == "HEAD") && sameToken(*token, token_);
}

bool Authorizer::hasCookie(const net::Request& request) const {
  const auto [begin, end] = request.headers.equal_range("Cookie");
  for (auto header = begin; header != end; ++header) {
    std::string_view rest = header->second;
    while (!rest.empty()) {
      const std::string_view pair = net::trimmed(rest.substr(0, rest.find(';')));
      rest.remove_prefix(std::min(rest.find(';'), rest.size() - 1) + 1);
      const std::size_t equals = pair.find('=');
      if (equals == std::string_view::npos || pair.substr(0, equals) != cookieName_) continue;
      if (sameToken(pair.substr(equals + 1), token_)) return true;
    }
  }
  return false;
}

net::Response Authorizer::cookieAndRedirect(const net::Request& request) const {
  std::string location = "./";
  char separator = '?';
  for (const auto& [name, value] : request.query) {
    if (name == "token") continue;
    location += separator + net::percentEncodePath(name) + "=" + net::percentEncodePath(value);
    separator = '&';
  }
  net::Response response;
  response.status = 303;
  response.headers = {{"Location", location},
                      {"Set-Cookie", cookieName_ + "=" + token_ + "; HttpOnly; SameSite=Strict; Path=/" +
                                         (tls_ ? "; Secure" : "")},
                      {"Cache-Control", "no-store"},
                      {"Referrer-Policy", "no-referrer"}};
  return response;
}

bool Authorizer::knows(const net::Request& request) const {
  return hasBearer(request) || hasQueryToken(request) || hasCookie(request);
}

std::optional<net::Response> Authorizer::operator()(const net::Request& request) const {
  if (!isHostAllowed(request)) {
    return problemResponse(421, "This server is for localhost only, but Host names another host.");
  }
  const bool reading = request.method == "GET" || request.method == "HEAD";
  if (reading && (request.path == "/healthz" || request.path == "/readyz")) return std::nullopt;
  if (hasBearer(request)) return std::nullopt;
  if (hasQueryToken(request)) {
    if (request.method == "GET" && request.path == "/") return cookieAndRedirect(request);
    return std::nullopt;
  }
  if (hasCookie(request)) {
    // The browser adds the cookie to every request. A write must therefore also prove that it comes from the
    // server's page.
    if (reading || (request.header("Origin") && net::originAllowed(request, allowedOrigins_)))
      return std::nullopt;
    return problemResponse(403,
                           "A write that is authorised by the cookie must have the Origin of this page.");
  }
  net::Response response = problemResponse(
      401, "A token is needed: open the URL that the server printed, or send Authorization: Bearer TOKEN.");
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

bool isLoopback(std::string_view host) {
  return net::equalIgnoringCase(host, "localhost") || host == "::1" || host == "[::1]" ||
         isLoopbackAddress(host);
}

std::string tokenUrl(std::string_view host, std::uint16_t port, std::string_view token, bool tls) {
  std::string shown(host);
  if (shown == "0.0.0.0" || shown == "::") shown = "127.0.0.1";
  if (shown.find(':') != std::string::npos && shown.front() != '[') shown = "[" + shown + "]";
  return (tls ? "https://" : "http://") + shown + ":" + std::to_string(port) +
         "/?token=" + net::percentEncodePath(token);
}

}  // namespace scolopax
