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

/// Orders header names without regard to ASCII case.
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
  /// Whether the handler runs where it may wait: RouteKind::slow, or after TakesLong.
  bool mayWait = false;
  /// Where it may wait: requested when the client has closed without waiting for the answer.
  std::stop_token gone;

  /// First header (query value) of that name, or nullptr.
  const std::string* header(std::string_view name) const;
  const std::string* queryValue(std::string_view name) const;
};

struct Response {
  int status = 200;
  std::string contentType;  ///< empty: no Content-Type
  std::string body;
  std::vector<std::pair<std::string, std::string>>
      headers;                            ///< further ones; lengths are the server's business
  std::shared_ptr<const void> keep = {};  ///< what lives until the answer has been sent
};

/// What the handler of a quick route throws, before it has changed anything, for a request that takes long:
/// it is called again where it may wait.
struct TakesLong {};

/// Runs on a worker thread. What it throws becomes a 500 that says nothing about the cause, and a log line.
using Handler = std::function<Response(const Request&)>;

}  // namespace scolopax::net
