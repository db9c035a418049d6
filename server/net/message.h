// SPDX-License-Identifier: Apache-2.0
// An HTTP request as handlers get it, checked and decoded, and the response that they return.
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
  std::string remoteAddress;         ///< the client's, as clientAddress(): numeric, without the port
  std::string flow;                  ///< Options::flowOf of the request or, if that is "", remoteAddress
  /// Whether the handler may wait. False in RouteKind::quick routes, except when called again after
  /// TakesLong.
  bool mayWait = false;
  /// If the handler may wait: requested when the client or the server closes the connection before the answer
  /// is sent.
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

/// The message with which requests are refused and streams closed while the server stops.
inline constexpr const char* kStopping = "the server is stopping";

/// Thrown by the handler of a quick route, before it changes anything, for a request that takes long. The
/// handler is then called again where it may wait.
struct TakesLong {};

/// Runs on a worker thread. An exception becomes a log line and a 500 that does not mention the cause.
using Handler = std::function<Response(const Request&)>;

}  // namespace scolopax::net
