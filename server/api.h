// SPDX-License-Identifier: Apache-2.0
// The HTTP interface: a table of routes, from which the server's routing and openapi.json are made. Connects
// net::Server with the data sets, the sessions and the renderer.
#pragma once
#include <atomic>
#include <exception>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "server/background.h"
#include "server/config.h"
#include "server/image_types.h"
#include "server/metrics.h"
#include "server/net/server.h"
#include "server/session_store.h"
#include "server/stream.h"
#include "server/unmeasured.h"
#include "server/unsent_answers.h"

namespace scolopax::server {

/// Everything that the handlers use. Must outlive the server.
struct ApiContext {
  const Config& config;
  const DatasetStore& datasets;
  const SceneResolver& renderResolver;  ///< for POST /render
  SessionStore& sessions;
  StreamHub& streams;
  Metrics& metrics;
  Background& encoders;  ///< encode the pictures in answers
  MakeRenderer makeRenderer;
  std::shared_ptr<MemoryBudget> memory;  ///< also charged by the renderers that makeRenderer returns
  const UnsentAnswers& answers;
  Log log;
  std::atomic<bool>& stopping;    ///< ends requests that wait
  std::stop_token abortRequests;  ///< ends requests that render, after two thirds of Config::stopGrace
  Now now;
  std::function<nlohmann::json()> capabilities;
  std::function<std::size_t()> unreadTextBytes;   ///< net::Server::unreadTextBytes()
  std::function<std::size_t()> requestBodyBytes;  ///< net::Server::requestBodyBytes()
};

struct Parameter {
  std::string name;
  std::string in;    ///< "path", "query" or "header"
  std::string type;  ///< JSON Schema type: "string", "integer", "number" or "boolean"
  std::string doc;
};

struct Route {
  std::string method;
  std::string path;  ///< from the root; {name} matches one segment and becomes a group of Request::matches
  std::string summary;
  std::vector<Parameter> parameters;
  std::string requestType;                 ///< media type of the body; empty: no body
  std::vector<std::string> responseTypes;  ///< media types of successful answers; the first is the usual one
  net::RouteKind kind = net::RouteKind::quick;
  net::Handler handler;
  std::vector<int> statuses = {};  ///< statuses of successful answers; empty: 200, or 204 without a body
};

std::vector<Route> datasetRoutes(ApiContext& context);
std::vector<Route> renderRoutes(ApiContext& context);
std::vector<Route> sessionRoutes(ApiContext& context);
std::vector<Route> operationRoutes(ApiContext& context);

/// OpenAPI 3.1 description of the routes.
nlohmann::json openApi(const std::vector<Route>& routes);

/// For net::Options::flowOf: the session's id for requests and streams at its address, else "". An unknown id
/// gives no flow of its own, so clients cannot create more flows than there are sessions.
std::string flowOf(const SessionStore& sessions, const net::Request& request);

/// Registers all routes and the upgrade to streams.
void addApi(net::Server& server, ApiContext& context);

// --- for the handlers ---

/// The error in the form in which a client gets it.
protocol::ProtocolError problemOf(const Error& error);
/// Rethrows any other exception than ProtocolError and Error.
protocol::ProtocolError problemOf(const std::exception_ptr& failure);
protocol::ProtocolError stoppingProblem();  ///< 503, the server is stopping
/// Why a long request was aborted: its client has disconnected or, otherwise, the server is stopping.
protocol::ProtocolError unwantedProblem(const net::Request& request);
net::Response jsonResponse(int status, const nlohmann::json& body);
net::Response errorResponse(const protocol::ProtocolError& error);
/// The body as JSON. Throws ProtocolError: 415 unless Content-Type is application/json or `alsoType`, and as
/// parseJson.
nlohmann::json jsonBody(const net::Request& request, const Config& config, std::string_view alsoType = "");
/// A whole number from the query, or `fallback` if it is absent. Throws ProtocolError(422) for anything else.
std::uint32_t queryUnsigned(const net::Request& request, std::string_view name, std::uint32_t fallback);
/// A finite number from the query. Throws ProtocolError(422) for anything else, and if it is absent.
double queryNumber(const net::Request& request, std::string_view name);
/// true or false from the query, false if it is absent. Throws ProtocolError(422) for anything else.
bool queryFlag(const net::Request& request, std::string_view name);

/// Returns work(stop), which may take long. Throws net::TakesLong if the handler may not wait. `stop` is
/// requested when the client disconnects or the server aborts its requests; an Error(cancelled) becomes a
/// ProtocolError(503).
template <class Work>
auto inLongRequest(const ApiContext& context, const net::Request& request, Work&& work) {
  if (!request.mayWait) throw net::TakesLong();
  std::stop_source ended;
  const auto end = [&ended] { ended.request_stop(); };
  const std::stop_callback gone(request.gone, end);
  const std::stop_callback ending(context.abortRequests, end);
  try {
    return work(ended.get_token());
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    throw unwantedProblem(request);
  }
}
/// Returns work(). If work() throws Unmeasured, measures the missing statistics in a long request and calls
/// it again.
template <class Work>
auto measuredIn(const ApiContext& context, const net::Request& request, Work&& work) {
  try {
    return work();
  } catch (const Unmeasured&) {
    return inLongRequest(context, request,
                         [&](const std::stop_token& stop) { return whenMeasured(stop, work); });
  }
}

/// Sets the body to encode(stop), which the encoders run when it is the turn of the request's flow. `bytes`
/// is the memory that encoding takes; it is charged to the budget. Throws what encode(), MemoryBudget::take
/// and UnsentAnswers::take throw, and ProtocolError(503) if the client disconnects or the server stops.
void setEncodedBody(const ApiContext& context, const net::Request& request, std::uint64_t bytes,
                    const std::function<std::string(const std::stop_token&)>& encode,
                    net::Response& response);

}  // namespace scolopax::server
