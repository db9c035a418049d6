// SPDX-License-Identifier: Apache-2.0
#include "server/net/head_rules.h"

#include <algorithm>
#include <array>
#include <boost/beast/http/error.hpp>
#include <charconv>

#include "server/net/url.h"

namespace scolopax::net {
namespace {

namespace http = boost::beast::http;

/// Limited because regular expressions match the path, and their recursion grows with its length.
constexpr std::size_t kPathLimit = 2048;
constexpr std::array<std::string_view, 7> kMethods{"GET",   "HEAD",   "POST",   "PUT",
                                                   "PATCH", "DELETE", "OPTIONS"};

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

std::optional<Refusal> readHead(const HeadFields& head, std::size_t bodyLimit, Request& request) {
  request.method = std::string(view(head.method_string()));
  for (const auto& field : head) {
    request.headers.emplace(view(field.name_string()), view(field.value()));
  }
  const auto count = [&](const char* name) { return request.headers.count(name); };

  const auto codings = request.headers.equal_range("Transfer-Encoding");
  if (codings.first != codings.second) {
    if (count("Content-Length") > 0)
      return Refusal{400, "Transfer-Encoding and Content-Length may not both be given."};
    if (head.version() < 11) return Refusal{400, "Transfer-Encoding needs HTTP/1.1."};
    if (count("Transfer-Encoding") > 1 || !equalIgnoringCase(codings.first->second, "chunked")) {
      return Refusal{501, "The only supported Transfer-Encoding is chunked."};
    }
  }
  if (count("Content-Length") > 1) return Refusal{400, "Content-Length is given more than once."};
  if (const std::string* length = request.header("Content-Length")) {
    std::uint64_t value = 0;
    const char* end = length->data() + length->size();
    const auto [stop, error] = std::from_chars(length->data(), end, value);
    if (stop != end || error == std::errc::invalid_argument)
      return Refusal{400, "Content-Length is not a number."};
    if (error != std::errc() || value > bodyLimit) {
      return Refusal{413, "The body may have at most " + std::to_string(bodyLimit) + " bytes."};
    }
  }
  const auto contentCodings = request.headers.equal_range("Content-Encoding");
  for (auto coding = contentCodings.first; coding != contentCodings.second; ++coding) {
    if (!equalIgnoringCase(coding->second, "identity")) {
      return Refusal{415, "A body must be sent without Content-Encoding."};
    }
  }
  if (count("Host") > 1 || (count("Host") == 0 && head.version() >= 11)) {
    return Refusal{400, "Exactly one Host header is required."};
  }
  if (std::find(kMethods.begin(), kMethods.end(), request.method) == kMethods.end()) {
    return Refusal{501, "This method is not supported."};
  }
  const std::string* expect = request.header("Expect");
  if (expect && !equalIgnoringCase(*expect, "100-continue")) {
    return Refusal{417, "The only supported expectation is 100-continue."};
  }
  const std::string_view target = view(head.target());
  if (target.substr(0, target.find('?')).size() > kPathLimit) return Refusal{414, "The path is too long."};
  std::optional<Target> parsed = parseTarget(target);
  if (!parsed) return Refusal{400, "The request target is not a path with valid percent-encoding."};
  request.path = std::move(parsed->path);
  request.query = std::move(parsed->query);
  return std::nullopt;
}

std::optional<Refusal> refusalOf(const boost::system::error_code& error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return Refusal{431, "The head of the request is too large."};
  }
  if (error == http::error::body_limit) return Refusal{413, "The body is too large."};
  if (error == http::error::bad_version) return Refusal{505, "Only HTTP/1.0 and HTTP/1.1 are supported."};
  if (error == http::error::end_of_stream || error == http::error::partial_message) return std::nullopt;
  if (error.category() == http::make_error_code(http::error::bad_method).category()) {
    return Refusal{400, "The request is malformed: " + error.message() + "."};
  }
  return std::nullopt;
}

}  // namespace scolopax::net
