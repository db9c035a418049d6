// SPDX-License-Identifier: Apache-2.0
// Routes for operating the server and for discovering what it can do.
#include <nlohmann/json.hpp>

#include "protocol/schema.h"
#include "server/api.h"

namespace scolopax::server {

std::vector<Route> operationRoutes(ApiContext& context) {
  const std::vector<std::string> kJson{"application/json"}, kText{"text/plain; charset=utf-8"};
  const auto text = [](std::string body) {
    return net::Response{200, "text/plain; charset=utf-8", std::move(body), {}};
  };
  return {
      {"GET",
       "/healthz",
       "Whether the process is running",
       {},
       "",
       kText,
       {},
       [text](const net::Request&) { return text("ok\n"); }},
      {"GET",
       "/readyz",
       "Whether the server accepts requests; 503 while it is stopping",
       {},
       "",
       kText,
       {},
       [text, &context](const net::Request&) {
         if (context.stopping) throw stoppingProblem();
         return text("ready\n");
       }},
      {"GET",
       "/metrics",
       "Counts and times in Prometheus' text format",
       {},
       "",
       kText,
       {},
       [&context](const net::Request&) {
         context.streams.countFrames();
         context.metrics.setSessions(context.sessions.all().size());
         context.metrics.setClients(context.streams.count());
         context.metrics.setUnreadTextBytes(context.unreadTextBytes());
         context.metrics.setRequestBodyBytes(context.requestBodyBytes());
         if (context.memory) context.metrics.setMemory(*context.memory);
         if (context.datasets.cache()) context.metrics.setVolumes(*context.datasets.cache());
         return net::Response{200, "text/plain; version=0.0.4; charset=utf-8", context.metrics.text(), {}};
       }},
      {"GET",
       "/api/v1/capabilities",
       "Blend modes, methods, colour maps, formats, limits, backend",
       {},
       "",
       kJson,
       {},
       [&context](const net::Request&) { return jsonResponse(200, context.capabilities()); }},
      {"GET",
       "/api/v1/schema.json",
       "JSON Schema of the scene",
       {},
       "",
       {"application/schema+json"},
       {},
       [&context](const net::Request&) {
         return net::Response{
             200, "application/schema+json", protocol::schemaText(context.renderResolver.lists()), {}};
       }},
  };
}

}  // namespace scolopax::server
