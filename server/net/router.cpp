// SPDX-License-Identifier: Apache-2.0
// The only file that uses cpp-httplib. It opens no socket: the request line is read from memory.
#include "server/net/router.h"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include "server/net/url.h"

namespace scolopax::net {
namespace {

// process_request is a protected function, whose behaviour was checked for this version only.
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

using Methods = std::map<std::string, Route, std::less<>>;

struct Found {
  const Methods* methods = nullptr;
  std::vector<std::string> groups;
};

// The matching pattern stores its result here. process_request runs on the calling thread.
thread_local Found* current = nullptr;

}  // namespace

/// The matcher has every pattern once, whatever its methods: one pattern per method would match each path
/// many times.
struct Router::Impl {
  Matcher matcher;
  std::map<std::string, Methods> patterns;
};

Router::Router() : impl_(std::make_unique<Impl>()) {}
Router::~Router() = default;

void Router::add(const std::string& method, const std::string& pattern, const Route& route) {
  if (std::find(kMethods.begin(), kMethods.end(), method) == kMethods.end())
    throw NetError("route " + method + " " + pattern +
                   ": expected one of GET, POST, PUT, PATCH, DELETE, OPTIONS");
  const auto [at, isNew] = impl_->patterns.try_emplace(pattern);
  at->second.try_emplace(method, route);
  if (!isNew) return;
  try {
    impl_->matcher.Get(pattern, [methods = &at->second](const httplib::Request& request, httplib::Response&) {
      current->methods = methods;
      for (const auto& group : request.matches) current->groups.push_back(group.str());
    });
  } catch (const std::regex_error& error) {
    throw NetError("route " + method + " " + pattern + ": not a regular expression: " + error.what());
  }
}

RouteMatch Router::find(const std::string& method, const std::string& path) const {
  Found found;
  current = &found;
  impl_->matcher.match("GET " + percentEncodePath(path) + " HTTP/1.1\r\nContent-Length: 0\r\n\r\n");
  current = nullptr;
  RouteMatch match;
  if (!found.methods) return match;
  const auto route = found.methods->find(method == "HEAD" ? "GET" : method);
  if (route != found.methods->end()) {
    match.route = &route->second;
    match.matches = std::move(found.groups);
    return match;
  }
  for (const char* other : kMethods) {
    if (!found.methods->contains(other)) continue;
    if (!match.allow.empty()) match.allow += ", ";
    match.allow += other;
    if (std::string_view(other) == "GET") match.allow += ", HEAD";
  }
  return match;
}

}  // namespace scolopax::net
