// SPDX-License-Identifier: Apache-2.0
#include "server/api.h"

#include <charconv>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "server/net/url.h"

namespace scolopax::server {
namespace {

using net::trimmed;
using nlohmann::json;
using protocol::ProtocolError;
using protocol::shortened;

constexpr std::string_view kSessionsPrefix = "/api/v1/sessions/";

/// The HTTP status that reports an error of this code.
int statusOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::badInput:
    case ErrorCode::unsupported:
      return 422;
    case ErrorCode::notFound:
      return 404;
    case ErrorCode::tooLarge:
      return 422;
    case ErrorCode::busy:
    case ErrorCode::cancelled:
    case ErrorCode::device:
      return 503;
    case ErrorCode::io:
      return 500;
  }
  return 500;
}

/// Wraps a handler: its exceptions become problems, and the cause of a 500 goes only into the log.
net::Handler guarded(const ApiContext& context, const net::Handler& handler) {
  return [handler, &context](const net::Request& request) -> net::Response {
    try {
      net::Response response = handler(request);
      if (!response.heldUntilSent)
        response.heldUntilSent = context.answers.take(request.flow, response.body.size());
      return response;
    } catch (const ProtocolError& error) {
      return errorResponse(error);
    } catch (const Error& error) {
      const ProtocolError problem = problemOf(error);
      if (problem.status < 500 || problem.status == 503) return errorResponse(problem);
      context.log(request.method + " " + request.path + ": " + error.what());
    } catch (const std::exception& error) {
      context.log(request.method + " " + request.path + ": " + error.what());
    }
    return errorResponse(ProtocolError(500, "", "the server failed to answer this request"));
  };
}

std::string regexOf(const std::string& path) {
  std::string regex;
  for (std::size_t at = 0; at < path.size(); ++at) {
    if (path[at] == '{') {
      regex += "([^/]+)";
      at = path.find('}', at);
    } else {
      if (path[at] == '.') regex += '\\';
      regex += path[at];
    }
  }
  return regex;
}

}  // namespace

ProtocolError problemOf(const Error& error) { return {statusOf(error.code()), "", error.what()}; }

ProtocolError problemOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const ProtocolError& error) {
    return error;
  } catch (const Error& error) {
    return problemOf(error);
  }
}

ProtocolError stoppingProblem() { return {503, "", net::kStopping}; }

ProtocolError unwantedProblem(const net::Request& request) {
  return request.gone.stop_requested() ? ProtocolError(503, "", "the client has disconnected")
                                       : stoppingProblem();
}

net::Response jsonResponse(int status, const json& body) {
  return {status, "application/json", protocol::jsonText(body), {}};
}

net::Response errorResponse(const ProtocolError& error) {
  net::Response response{error.status, std::string(protocol::kProblemType), protocol::problemJson(error), {}};
  if (error.status == 503 || error.status == 429) response.headers.emplace_back("Retry-After", "1");
  return response;
}

json jsonBody(const net::Request& request, const Config& config, std::string_view alsoType) {
  const std::string* header = request.header("content-type");
  const std::string_view type = header ? trimmed(std::string_view(*header).substr(0, header->find(';'))) : "";
  if (type != "application/json" && (alsoType.empty() || type != alsoType))
    throw ProtocolError(415, "",
                        "expected Content-Type application/json" +
                            (alsoType.empty() ? "" : " or " + std::string(alsoType)) + ", found " +
                            (type.empty() ? "none" : shortened(type)));
  return protocol::parseJson(request.body, {config.maxBodyBytes, config.maxJsonDepth});
}

std::uint32_t queryUnsigned(const net::Request& request, std::string_view name, std::uint32_t fallback) {
  const std::string* text = request.queryValue(name);
  if (!text) return fallback;
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (error != std::errc() || end != text->data() + text->size())
    throw ProtocolError(422, "",
                        "query parameter " + std::string(name) +
                            ": expected a whole number from 0 to 4294967295, found \"" + shortened(*text) +
                            '"');
  return value;
}

double queryNumber(const net::Request& request, std::string_view name) {
  const std::string* text = request.queryValue(name);
  double value = 0;
  if (text) {
    const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
    if (error == std::errc() && end == text->data() + text->size() && std::isfinite(value)) return value;
  }
  throw ProtocolError(422, "",
                      "query parameter " + std::string(name) + ": expected a number, found " +
                          (text ? '"' + shortened(*text) + '"' : "none"));
}

bool queryFlag(const net::Request& request, std::string_view name) {
  const std::string* text = request.queryValue(name);
  if (!text || *text == "false") return false;
  if (*text == "true") return true;
  throw ProtocolError(
      422, "",
      "query parameter " + std::string(name) + ": expected true or false, found \"" + shortened(*text) + '"');
}

void setEncodedBody(const ApiContext& context, const net::Request& request, std::uint64_t bytes,
                    const std::function<std::string(const std::stop_token&)>& encode,
                    net::Response& response) {
  inLongRequest(context, request, [&](const std::stop_token& stop) {
    context.encoders.run(request.flow, stop, [&](const std::stop_token& cancelled) {
      auto memory = MemoryBudget::take(context.memory, MemoryUse::encodings, bytes);
      response.body = encode(cancelled);
      memory.resize(0);
      response.heldUntilSent = context.answers.take(request.flow, response.body.size());
    });
  });
}

json openApi(const std::vector<Route>& routes) {
  json paths = json::object();
  for (const Route& route : routes) {
    json parameters = json::array();
    for (const Parameter& p : route.parameters)
      parameters.push_back({{"name", p.name},
                            {"in", p.in},
                            {"required", p.in == "path"},
                            {"description", p.doc},
                            {"schema", {{"type", p.type}}}});
    json content = json::object();
    for (const std::string& type : route.responseTypes) content[type] = json::object();
    json responses = {{"default",
                       {{"description", "What is wrong, with a pointer to the field (RFC 9457)"},
                        {"content", {{std::string(protocol::kProblemType), json::object()}}}}}};
    const int usual = route.responseTypes.empty() ? 204 : 200;
    for (const int status : route.statuses.empty() ? std::vector{usual} : route.statuses)
      responses[std::to_string(status)] = {{"description", "Done"},
                                           {"content", status == 204 ? json::object() : content}};
    std::string method;
    for (const char c : route.method) method += char(c - 'A' + 'a');
    json operation = {{"summary", route.summary},
                      {"parameters", std::move(parameters)},
                      {"responses", std::move(responses)}};
    if (!route.requestType.empty())
      operation["requestBody"] = {{"content", {{route.requestType, json::object()}}}};
    paths[route.path][method] = std::move(operation);
  }
  return {{"openapi", "3.1.0"},
          {"info", {{"title", "Scolopax"}, {"version", SCOLOPAX_VERSION}}},
          {"components", {{"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}}},
          {"security", json::array({{{"token", json::array()}}})},
          {"paths", std::move(paths)}};
}

std::string flowOf(const SessionStore& sessions, const net::Request& request) {
  std::string_view rest = request.path;
  if (!rest.starts_with(kSessionsPrefix)) return "";
  rest.remove_prefix(kSessionsPrefix.size());
  const auto session = sessions.find(rest.substr(0, rest.find('/')));
  return session ? session->id() : "";
}

void addApi(net::Server& server, ApiContext& context) {
  std::vector<Route> routes;
  for (auto family : {datasetRoutes, renderRoutes, sessionRoutes, operationRoutes})
    for (Route& route : family(context)) routes.push_back(std::move(route));
  routes.push_back({"GET", "/api/v1/openapi.json", "This description", {}, "", {"application/json"}, {}, {}});
  routes.back().handler = [description = openApi(routes)](const net::Request&) {
    return jsonResponse(200, description);
  };
  for (const Route& route : routes)
    server.route(route.method, regexOf(route.path), guarded(context, route.handler), route.kind);

  static constexpr std::string_view kSuffix = "/stream";
  server.upgrade([&context](const net::Request& request, const std::shared_ptr<net::WebSocket>& socket)
                     -> std::variant<net::WebSocketEvents, net::Response> {
    try {
      const std::string_view path = request.path;
      if (path.size() <= kSessionsPrefix.size() + kSuffix.size() || !path.starts_with(kSessionsPrefix) ||
          !path.ends_with(kSuffix))
        throw ProtocolError(404, "", "expected the stream of a session, found " + shortened(request.path));
      const auto id =
          path.substr(kSessionsPrefix.size(), path.size() - kSessionsPrefix.size() - kSuffix.size());
      const auto session = context.sessions.find(id);
      if (!session)
        throw ProtocolError(404, "", "there is no session " + shortened(id) + "; it may have ended");
      return context.streams.join(session, socket, request.remoteAddress);
    } catch (const ProtocolError& error) {
      return errorResponse(error);
    }
  });
}

}  // namespace scolopax::server
