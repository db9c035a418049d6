// SPDX-License-Identifier: Apache-2.0
// The HTTP interface: one table of routes, from which the server's routing and openapi.json are made.
// Between net::Server and data sets, sessions, renderer.
#pragma once
#include <atomic>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "server/config.h"
#include "server/metrics.h"
#include "server/net/server.h"
#include "server/session_store.h"
#include "server/stream.h"
#include "server/unmeasured.h"

namespace scolopax::server {

/// What the handlers work with. Outlives the server.
struct ApiContext {
  const Config& config;
  const DatasetStore& datasets;
  const SceneResolver& renderResolver;  ///< for POST /render, with its default sample count
  SessionStore& sessions;
  StreamHub& streams;
  Metrics& metrics;
  MakeRenderer makeRenderer;
  std::shared_ptr<MemoryBudget> memory;  ///< of makeRenderer's renderers too
  Log log;
  std::atomic<bool>& stopping;  ///< ends what waits
  std::stop_token cutting;      ///< ends what renders, after the grace
  std::function<nlohmann::json()> capabilities;
};

struct Parameter {
  std::string name;
  std::string in;    ///< "path", "query" or "header"
  std::string type;  ///< of JSON Schema: "string", "integer", "number", "boolean"
  std::string doc;
};

struct Route {
  std::string method;
  std::string path;  ///< from the root; {name} stands for one segment and is a group of Request::matches
  std::string summary;
  std::vector<Parameter> parameters;
  std::string requestType;                 ///< media type of the body; empty: none
  std::vector<std::string> responseTypes;  ///< of the good answers; the first is the usual
  net::RouteKind kind = net::RouteKind::quick;
  net::Handler handler;
  std::vector<int> statuses = {};  ///< of the good answers where they are not 200, or 204 without a body
};

std::vector<Route> datasetRoutes(ApiContext& context);
std::vector<Route> renderRoutes(ApiContext& context);
std::vector<Route> sessionRoutes(ApiContext& context);
std::vector<Route> operationRoutes(ApiContext& context);

/// OpenAPI 3.1 description of the routes.
nlohmann::json openApi(const std::vector<Route>& routes);

/// Registers all routes and the stream's upgrade.
void addApi(net::Server& server, ApiContext& context);

// --- for the handlers
// ------------------------------------------------------------------------------------------

/// The HTTP status that tells of an error.
int statusOf(ErrorCode code);
net::Response jsonResponse(int status, const nlohmann::json& body);
net::Response errorResponse(const protocol::ProtocolError& error);
/// The body as JSON; throws ProtocolError, 415 unless Content-Type is application/json or `alsoType`.
nlohmann::json jsonBody(const net::Request& request, const Config& config, std::string_view alsoType = "");
/// A number from the query; `fallback` when absent; throws ProtocolError(422) for anything else.
std::uint32_t queryUnsigned(const net::Request& request, std::string_view name, std::uint32_t fallback);
/// Throws ProtocolError(422) also when absent.
double queryNumber(const net::Request& request, std::string_view name);
/// true or false; false when absent.
bool queryFlag(const net::Request& request, std::string_view name);

/// What work(stop) returns, which takes long: throws net::TakesLong where nothing may wait. `stop` is
/// requested when the client has gone or the server ends; then Error(cancelled) becomes ProtocolError(503).
template <class Work>
auto inLongRequest(const ApiContext& context, const net::Request& request, Work&& work) {
  if (!request.mayWait) throw net::TakesLong();
  std::stop_source ended;
  const auto end = [&ended] { ended.request_stop(); };
  const std::stop_callback gone(request.gone, end);
  const std::stop_callback ending(context.cutting, end);
  try {
    return work(ended.get_token());
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    throw protocol::ProtocolError(
        503, "", request.gone.stop_requested() ? "the client has gone" : "the server is stopping");
  }
}
/// What work() returns; where it throws Unmeasured, in a long request, once that is measured.
template <class Work>
auto measuredIn(const ApiContext& context, const net::Request& request, Work&& work) {
  try {
    return work();
  } catch (const Unmeasured&) {
    return inLongRequest(context, request,
                         [&](const std::stop_token& stop) { return whenMeasured(stop, work); });
  }
}

struct ImageType {
  std::string_view format;     ///< "jpeg"
  std::string_view mediaType;  ///< "image/jpeg"
};
inline constexpr ImageType kImageTypes[] = {
    {"jpeg", "image/jpeg"}, {"png", "image/png"}, {"exr", "image/x-exr"}};
/// The type of image that an Accept header likes best, the first of equals; nullptr: none.
const ImageType* acceptedImageType(const std::string* accept);
/// Memory that imageBytes takes for so many pixels.
std::uint64_t imageMemory(std::uint64_t pixels, std::string_view format);
/// The bytes of a picture: jpeg at quality 95, 4:4:4; png; exr as float32 linear premultiplied RGBA.
std::string imageBytes(const Image& image, glm::vec3 background, std::string_view format);

}  // namespace scolopax::server
