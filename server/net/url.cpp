// SPDX-License-Identifier: Apache-2.0
#include "server/net/url.h"

#include <algorithm>
#include <charconv>

namespace scolopax::net {
namespace {

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool isUnreserved(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
         c == '_' || c == '~';
}

}  // namespace

std::optional<std::string> percentDecode(std::string_view text, bool plusIsSpace) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '+' && plusIsSpace) {
      c = ' ';
    } else if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hexDigit(text[i + 1]);
      const int low = hexDigit(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (c == '\0') return std::nullopt;
    out += c;
  }
  return out;
}

std::string percentEncodePath(std::string_view path) {
  constexpr char kHex[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : path) {
    if (isUnreserved(c) || c == '/') {
      out += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::optional<Target> parseTarget(std::string_view target) {
  if (target.empty() || target.front() != '/') return std::nullopt;
  target = target.substr(0, target.find('#'));
  const std::size_t mark = target.find('?');
  std::optional<std::string> path = percentDecode(target.substr(0, mark), false);
  if (!path) return std::nullopt;
  Target out{std::move(*path), {}};
  std::string_view rest = mark == std::string_view::npos ? "" : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    if (pair.empty()) continue;
    const std::size_t equals = pair.find('=');
    auto name = percentDecode(pair.substr(0, equals), true);
    auto value = percentDecode(equals == std::string_view::npos ? "" : pair.substr(equals + 1), true);
    if (!name || !value) return std::nullopt;
    out.query.emplace(std::move(*name), std::move(*value));
  }
  return out;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

bool equalIgnoringCase(std::string_view a, std::string_view b) {
  const NameLess less;
  return a.size() == b.size() && !less(a, b) && !less(b, a);
}

std::optional<Authority> parseAuthority(std::string_view text) {
  const bool bracketed = text.starts_with('[');
  const std::size_t end = bracketed ? text.find(']') + 1 : std::min(text.find(':'), text.size());
  const std::string_view host = text.substr(0, end);
  const std::string_view name = bracketed && end > 2 ? host.substr(1, end - 2) : bracketed ? "" : host;
  const auto isAddress = [](char c) { return hexDigit(c) >= 0 || c == ':' || c == '.'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(),
                                   [&](char c) { return bracketed ? isAddress(c) : isUnreserved(c); }))
    return std::nullopt;
  const std::string_view rest = text.substr(end);
  if (rest.empty()) return Authority{host, std::nullopt};
  std::uint16_t port = 0;
  const char* const last = rest.data() + rest.size();
  const auto [stop, error] = std::from_chars(rest.data() + 1, last, port);
  if (rest.front() != ':' || error != std::errc() || stop != last) return std::nullopt;
  return Authority{host, port};
}

bool sameOrigin(std::string_view origin, std::string_view host) {
  const std::size_t mark = std::min(origin.find("://"), origin.size());
  const std::string_view scheme = origin.substr(0, mark);
  const bool secure = equalIgnoringCase(scheme, "https");
  if ((!secure && !equalIgnoringCase(scheme, "http")) || mark == origin.size()) return false;
  const auto from = parseAuthority(origin.substr(mark + 3)), to = parseAuthority(host);
  const std::uint16_t usual = secure ? 443 : 80;
  return from && to && equalIgnoringCase(from->host, to->host) &&
         from->port.value_or(usual) == to->port.value_or(usual);
}

bool originAllowed(const Request& request, const std::vector<std::string>& allowed) {
  if (request.headers.count("Origin") > 1) return false;
  const std::string* origin = request.header("Origin");
  if (!origin) return true;
  const std::string* host = request.header("Host");
  if (host && sameOrigin(*origin, *host)) return true;
  return std::any_of(allowed.begin(), allowed.end(),
                     [&](const std::string& one) { return equalIgnoringCase(one, *origin); });
}

}  // namespace scolopax::net
