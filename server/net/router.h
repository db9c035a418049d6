// SPDX-License-Identifier: Apache-2.0
// Finds the handler for a method and path. cpp-httplib matches the path; it never gets bodies, queries and
// headers, so its limits and conversions do not apply to them.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "server/net/server.h"

namespace scolopax::net {

struct Route {
  Handler handler;
  RouteKind kind = RouteKind::quick;
};

struct RouteMatch {
  const Route* route = nullptr;      ///< null: no such path, or not with this method
  std::vector<std::string> matches;  ///< regex groups, [0] the whole path
  std::string allow;                 ///< for 405: the methods that this path does have, "GET, HEAD"
};

class Router {
 public:
  Router();
  ~Router();
  /// If several patterns match a path, the one that was added first is used, even if it lacks the method.
  /// Throws NetError for an unknown method or an invalid regex.
  void add(const std::string& method, const std::string& pattern, const Route& route);
  /// `path` is decoded. Thread-safe once all routes are added.
  RouteMatch find(const std::string& method, const std::string& path) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
