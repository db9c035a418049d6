// SPDX-License-Identifier: Apache-2.0
// The HTTP interface: one table of routes, from which the server's routing and openapi.json are made. It
// connects net::Server with the data sets, the sessions and the renderer.
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

/// What the handlers work with. Must outlive the server.
struct ApiContext {
  const Config& config;
  const DatasetStore& datasets;
  const SceneResolver& renderResolver;  ///< for POST /render, with that call's default sample count
  SessionStore& sessions;
  StreamHub& streams;
  Metrics& metrics;
  Background& encoders;  ///< for the pictures of answers
  MakeRenderer makeRenderer;
  std::shared_ptr<MemoryBudget> memory;  ///< also charged by the renderers that makeRenderer returns
  const UnsentAnswers& answers;
  Log log;
  std::atomic<bool>& stopping;    ///< ends requests that wait
  std::stop_token abortRequests;  ///< ends requests that render, after two thirds of Config::stopGrace
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

/// net::Options::flowOf: a session's id for all requests and streams at its address, else "". A name that no
/// session has makes no flow, so that a client cannot make more flows than there are sessions.
std::string flowOf(const SessionStore& sessions, const net::Request& request);

/// Registers all routes and the stream's upgrade.
void addApi(net::Server& server, ApiContext& context);

// --- for the handlers ---

/// What tells a client of an error.
protocol::ProtocolError problemOf(const Error& error);
/// Rethrows what is neither a ProtocolError nor an Error.
protocol::ProtocolError problemOf(const std::exception_ptr& failure);
protocol::ProtocolError stoppingProblem();  ///< 503, the server is stopping
/// Why a request ends that takes long: its client has gone, or else the server is stopping.
protocol::ProtocolError unwantedProblem(const net::Request& request);
net::Response jsonResponse(int status, const nlohmann::json& body);
net::Response errorResponse(const protocol::ProtocolError& error);
/// The body as JSON. Throws ProtocolError: 415 unless Content-Type is application/json or `alsoType`, and
/// what parseJson throws.
nlohmann::json jsonBody(const net::Request& request, const Config& config, std::string_view alsoType = "");
/// A whole number from the query, `fallback` if absent. Throws ProtocolError(422) for anything else.
std::uint32_t queryUnsigned(const net::Request& request, std::string_view name, std::uint32_t fallback);
/// A finite number from the query. Throws ProtocolError(422) for anything else, and if absent.
double queryNumber(const net::Request& request, std::string_view name);
/// true or false from the query, false if absent. Throws ProtocolError(422) for anything else.
bool queryFlag(const net::Request& request, std::string_view name);

/// Returns work(stop), which may take long; throws net::TakesLong where the handler may not wait. `stop` is
/// requested when the client has disconnected or the server aborts its requests; Error(cancelled) then
/// becomes ProtocolError(503).
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
/// Returns work(). If it throws Unmeasured, measures what is missing in a long request and calls work()
/// again.
template <class Work>
auto measuredIn(const ApiContext& context, const net::Request& request, Work&& work) {
  try {
    return work();
  } catch (const Unmeasured&) {
    return inLongRequest(context, request,
                         [&](const std::stop_token& stop) { return whenMeasured(stop, work); });
  }
}

/// Sets the body to encode(stop), run by the encoders when it is the turn of the request's flow, and charges
/// `bytes` of memory for that. Throws what encode(), MemoryBudget::take and UnsentAnswers::take throw, and
/// ProtocolError(503) if the client disconnects or the server stops.
void setEncodedBody(const ApiContext& context, const net::Request& request, std::uint64_t bytes,
                    const std::function<std::string(const std::stop_token&)>& encode,
                    net::Response& response);

}  // namespace scolopax::server
