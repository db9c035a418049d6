// SPDX-License-Identifier: Apache-2.0
// The handlers of the HTTP interface without a network, called as a server would.
#pragma once
#include <gtest/gtest.h>

#include <regex>

#include "protocol/problem.h"
#include "server/api.h"
#include "tests/server/fakes.h"

namespace scolopax::server::testing {

struct Api {
  std::shared_ptr<MemoryBudget> memory;
  UnsentAnswers answers{memory};
  Config config;
  Workshop workshop;
  Metrics metrics;
  std::shared_ptr<const DatasetStore> datasets = smallStore();
  SceneResolver resolver{datasets, {1000}};
  BackgroundThreads encoders{2};
  StreamHub streams{workshop.store, workshop.background, metrics, {64, {}, {}, {}, workshop.hooks.now}};
  std::atomic<bool> stopping{false};
  std::stop_source gone, abortRequests;
  std::string client = "192.0.2.1";  ///< address from which calls come
  int tookLong = 0;                  ///< calls of quick routes that had to be repeated where they may wait
  ApiContext context{config,
                     *datasets,
                     resolver,
                     workshop.store,
                     streams,
                     metrics,
                     encoders,
                     [this](const std::shared_ptr<const Volume>&) {
                       return std::make_unique<FakeRenderer>(workshop.control);
                     },
                     memory,
                     answers,
                     [](const std::string&) {},
                     stopping,
                     abortRequests.get_token(),
                     workshop.clock.now(),
                     [] {
                       return nlohmann::json{{"backend", "fake"}};
                     },
                     [] { return std::size_t(123); },
                     [] { return std::size_t(456); }};
  std::vector<Route> routes;

  /// `budget`: for encodings and answers.
  explicit Api(std::shared_ptr<MemoryBudget> budget = nullptr) : memory(std::move(budget)) {
    config.pollTimeout = std::chrono::milliseconds(0);
    config.maxRenders = 1;
    for (auto family : {datasetRoutes, renderRoutes, sessionRoutes, operationRoutes})
      for (Route& route : family(context)) routes.push_back(std::move(route));
  }

  /// Calls the route's handler and throws its exceptions. `target` may have a query.
  net::Response call(const std::string& method, const std::string& target, const std::string& body = "",
                     net::Headers headers = {{"Content-Type", "application/json"}}) {
    net::Request request;
    request.method = method;
    request.path = target.substr(0, target.find('?'));
    request.body = body;
    request.headers = std::move(headers);
    request.gone = gone.get_token();
    request.remoteAddress = client;
    static const std::regex pair("[?&]([^=]+)=([^&]*)");
    for (std::sregex_iterator at(target.begin(), target.end(), pair), end; at != end; ++at)
      request.query.emplace((*at)[1], (*at)[2]);
    for (const Route& route : routes) {
      const std::regex pattern(std::regex_replace(route.path, std::regex("\\{[^}]*\\}"), "([^/]+)"));
      std::smatch match;
      if (route.method != method || !std::regex_match(request.path, match, pattern)) continue;
      request.matches.assign(match.begin(), match.end());
      request.mayWait = route.kind != net::RouteKind::quick;
      try {
        return route.handler(request);
      } catch (const net::TakesLong&) {
        EXPECT_FALSE(request.mayWait);
        ++tookLong;
        request.mayWait = true;
        return route.handler(request);
      }
    }
    ADD_FAILURE() << "no route for " << method << " " << target;
    return {};
  }

  std::pair<int, std::string> errorOf(const std::string& method, const std::string& target,
                                      const std::string& body = "",
                                      const net::Headers& headers = {{"Content-Type", "application/json"}}) {
    try {
      return {call(method, target, body, headers).status, "no error"};
    } catch (const protocol::ProtocolError& error) {
      return {error.status, error.pointer};
    }
  }
};

}  // namespace scolopax::server::testing
