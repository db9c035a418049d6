// SPDX-License-Identifier: Apache-2.0
// The only file that uses cpp-httplib. It opens no socket with it: the request line is read from memory.
#include "server/net/router.h"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <string_view>
#include <utility>

#include "server/net/url.h"

namespace scolopax::net {
namespace {

// process_request is a protected function: its behaviour was checked for this version.
static_assert(std::string_view(CPPHTTPLIB_VERSION) == "0.11.4");

constexpr std::array<const char*, 6> kMethods{"GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};

/// Reads a request from memory and discards the answer: the matching route has already noted the result.
class MemoryStream : public httplib::Stream {
 public:
  explicit MemoryStream(std::string_view input) : input_(input) {}
  bool is_readable() const override { return !input_.empty(); }
  bool is_writable() const override { return true; }
  ssize_t read(char* to, std::size_t size) override {
    size = std::min(size, input_.size());
    std::memcpy(to, input_.data(), size);
    input_.remove_prefix(size);
    return static_cast<ssize_t>(size);
  }
  ssize_t write(const char*, std::size_t size) override { return static_cast<ssize_t>(size); }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

 private:
  std::string_view input_;
};

class Matcher : public httplib::Server {
 public:
  Matcher() {
    // process_request handles a request only while the server counts as started.
    svr_sock_ = 0;
    set_exception_handler([](const httplib::Request&, httplib::Response& response,
                             const std::exception_ptr&) { response.status = 500; });
  }
  ~Matcher() override { svr_sock_ = INVALID_SOCKET; }

  void match(const std::string& request) {
    MemoryStream stream(request);
    bool closed = false;
    process_request(stream, true, closed, [](httplib::Request&) {});
  }
};

// process_request runs on the calling thread: the matching route stores its result here.
thread_local RouteMatch* currentMatch = nullptr;

}  // namespace

struct Router::Impl {
  Matcher matcher;
  std::deque<Route> routes;

  void match(const std::string& method, const std::string& encodedPath, RouteMatch& match) {
    currentMatch = &match;
    matcher.match(method + " " + encodedPath + " HTTP/1.1\r\nContent-Length: 0\r\n\r\n");
    currentMatch = nullptr;
  }
};

Router::Router() : impl_(std::make_unique<Impl>()) {}
Router::~Router() = default;

void Router::add(const std::string& method, const std::string& pattern, Route route) {
  const Route* kept = &impl_->routes.emplace_back(std::move(route));
  const auto note = [kept](const httplib::Request& request, httplib::Response&) {
    currentMatch->route = kept;
    for (const auto& group : request.matches) currentMatch->matches.push_back(group.str());
  };
  try {
    if (method == "GET") {
      impl_->matcher.Get(pattern, note);
    } else if (method == "POST") {
      impl_->matcher.Post(pattern, note);
    } else if (method == "PUT") {
      impl_->matcher.Put(pattern, note);
    } else if (method == "PATCH") {
      impl_->matcher.Patch(pattern, note);
    } else if (method == "DELETE") {
      impl_->matcher.Delete(pattern, note);
    } else if (method == "OPTIONS") {
      impl_->matcher.Options(pattern, note);
    } else {
      throw NetError("route " + method + " " + pattern +
                     ": expected one of GET, POST, PUT, PATCH, DELETE, OPTIONS");
    }
  } catch (const std::regex_error& error) {
    throw NetError("route " + method + " " + pattern + ": not a regular expression: " + error.what());
  }
}

RouteMatch Router::find(const std::string& method, const std::string& path) const {
  const std::string encoded = percentEncodePath(path);
  RouteMatch match;
  impl_->match(method, encoded, match);
  if (match.route) return match;
  for (const char* other : kMethods) {
    RouteMatch probe;
    impl_->match(other, encoded, probe);
    if (!probe.route) continue;
    if (!match.allow.empty()) match.allow += ", ";
    match.allow += other;
    if (std::string_view(other) == "GET") match.allow += ", HEAD";
  }
  return match;
}

}  // namespace scolopax::net
