// SPDX-License-Identifier: Apache-2.0
// One HTTP request as handlers see it, already checked and decoded, and the response they return.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scolopax::net {

/// Orders header names, ignoring ASCII case.
struct NameLess {
  using is_transparent = void;
  bool operator()(std::string_view a, std::string_view b) const;
};
using Headers = std::multimap<std::string, std::string, NameLess>;
using Query = std::multimap<std::string, std::string, std::less<>>;

struct Request {
  std::string method;                ///< upper case; HEAD stays HEAD (its body is dropped on the way out)
  std::string path;                  ///< percent-decoded, begins with "/", without the query
  Query query;                       ///< percent-decoded, "+" is a space
  Headers headers;                   ///< as sent
  std::string body;                  ///< whole and within the limit; empty in authorize and upgrades
  std::vector<std::string> matches;  ///< regex groups of the route; [0] is the whole path
  std::string remoteAddress;         ///< numeric, without the port
  std::string flow;                  ///< what Options::flowOf says; if that is nothing, remoteAddress
  /// Whether the handler may wait: unless in a RouteKind::quick route, or when called again after TakesLong.
  bool mayWait = false;
  /// If the handler may wait: requested when the client closes the connection before it has the answer, or
  /// the server does.
  std::stop_token gone;

  /// First header (query value) of that name, or nullptr.
  const std::string* header(std::string_view name) const;
  const std::string* queryValue(std::string_view name) const;
};

struct Response {
  int status = 200;
  std::string contentType;  ///< empty: no Content-Type
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;  ///< further headers; the server sets the lengths
  std::shared_ptr<const void> heldUntilSent = {};            ///< released once the answer has been sent
};

/// Why requests are refused and streams closed while the server stops.
inline constexpr const char* kStopping = "the server is stopping";

/// Thrown by the handler of a quick route, before it has changed anything, for a request that takes long: the
/// handler is called again where it may wait.
struct TakesLong {};

/// Runs on a worker thread. An exception becomes a log line and a 500 that does not tell the cause.
using Handler = std::function<Response(const Request&)>;

}  // namespace scolopax::net
