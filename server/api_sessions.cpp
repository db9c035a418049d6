// SPDX-License-Identifier: Apache-2.0
// Routes of sessions. With them a script can do everything that a stream can.
#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "renderer/core/short_text.h"
#include "renderer/data/aov.h"
#include "server/api.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using protocol::ProtocolError;
using protocol::shortened;

constexpr std::string_view kMergePatch = "application/merge-patch+json";

std::shared_ptr<Session> sessionOf(const ApiContext& context, const net::Request& request) {
  auto session = context.sessions.find(request.matches.at(1));
  if (!session)
    throw ProtocolError(404, "",
                        "there is no session " + shortened(request.matches.at(1)) + "; it may have ended");
  return session;
}

/// The revision in If-Match: a number, with or without quotes.
EditOrigin originOf(const net::Request& request) {
  EditOrigin origin;
  const std::string* header = request.header("if-match");
  if (!header || *header == "*") return origin;
  std::string_view text = *header;
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  std::uint32_t revision = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), revision);
  if (error != std::errc() || end != text.data() + text.size())
    throw ProtocolError(400, "", "If-Match: expected a revision, found " + shortened(*header));
  origin.ifRevision = revision;
  return origin;
}

net::Response withTag(net::Response response, const Session::SceneState& state) {
  response.headers.emplace_back("ETag", '"' + std::to_string(state.revision) + '"');
  return response;
}

json sceneJson(const Session::SceneState& state) {
  return {{"revision", state.revision}, {"scene", protocol::toJson(state.scene->resolved)}};
}

/// The answer to a request that has changed something. If there is no memory for such a long answer, the
/// scene is left out; a refusal would mean that nothing has changed.
net::Response changedResponse(const ApiContext& context, const net::Request& request, int status, json body) {
  auto response = jsonResponse(status, body);
  try {
    response.heldUntilSent = context.answers.take(request.flow, response.body.size());
  } catch (const Error&) {
    body.erase("scene");
    response = jsonResponse(status, body);
  }
  return response;
}

/// Makes the edit. The data that it needs is measured first.
template <class Edit>
net::Response edited(const ApiContext& context, const net::Request& request, Edit&& edit) {
  const auto session = sessionOf(context, request);
  const EditOrigin origin = originOf(request);
  const auto state = measuredIn(context, request, [&] { return edit(*session, origin); });
  return withTag(changedResponse(context, request, 200, sceneJson(state)), state);
}

net::Response create(ApiContext& context, const net::Request& request) {
  json scene = json::object();
  if (!request.body.empty()) {
    json body = jsonBody(request, context.config);
    if (!body.is_object()) throw ProtocolError(422, "", "expected an object");
    for (const auto& [key, value] : body.items())
      if (key != "scene") throw ProtocolError(422, "/" + shortened(key), "unknown field; expected scene");
    if (body.contains("scene")) scene = std::move(body["scene"]);
  }
  const auto session =
      measuredIn(context, request, [&] { return context.sessions.create(scene, request.remoteAddress); });
  json body = sceneJson(session->scene());
  body["id"] = session->id();
  body["token"] = session->token();
  body["stream"] = "api/v1/sessions/" + session->id() + "/stream";
  auto response = changedResponse(context, request, 201, std::move(body));
  response.headers.emplace_back("Location", "/api/v1/sessions/" + session->id());
  return response;
}

net::Response describe(ApiContext& context, const net::Request& request) {
  const auto session = sessionOf(context, request);
  const auto state = session->scene();
  json description = {{"id", session->id()},
                      {"revision", state.revision},
                      {"dataset", state.scene->dataset->id()},
                      {"viewers", session->viewerCount()}};
  if (const auto frame = session->latestFrame())
    description["frame"] = {{"frame", frame->info.number},
                            {"revision", frame->info.revision},
                            {"samples", frame->info.samples},
                            {"error", frame->info.error},
                            {"final", frame->info.final}};
  return jsonResponse(200, description);
}

double secondsOf(std::chrono::milliseconds time) { return std::chrono::duration<double>(time).count(); }

std::chrono::milliseconds pollTimeout(const Config& config, const net::Request& request) {
  if (!request.queryValue("timeout")) return config.pollTimeout;
  const double most = secondsOf(config.pollTimeout);
  const double seconds = queryNumber(request, "timeout");
  if (seconds < 0)
    throw ProtocolError(422, "", "query parameter timeout: expected a number of seconds >= 0, found less");
  return std::chrono::milliseconds(std::int64_t(std::min(seconds, most) * 1000));
}

std::optional<Aov> queryAov(const net::Request& request) {
  const std::string* asked = request.queryValue("aov");
  if (!asked) return std::nullopt;
  if (const auto aov = aovOf(*asked)) return aov;
  throw ProtocolError(
      422, "", "query parameter aov: expected one of " + aovNames() + ", found \"" + shortened(*asked) + '"');
}

net::Response frame(ApiContext& context, const net::Request& request) {
  const auto session = sessionOf(context, request);
  const std::string* asked = request.queryValue("format");
  const ImageType* type = asked ? imageTypeOf(*asked) : &imageTypes().front();
  if (!type)
    throw ProtocolError(422, "",
                        "query parameter format: expected " + imageTypesText(&ImageType::format) +
                            ", found \"" + shortened(*asked) + '"');
  const std::optional<Aov> aov = queryAov(request);
  const bool encoded = !aov && type->format == "jpeg";  // as viewers get it
  const FrameQuery query{.after = queryUnsigned(request, "after", 0),
                         .minSamples = queryUnsigned(request, "minSamples", 1),
                         .aovs = aov.has_value(),
                         .gone = request.gone,
                         .image = !aov && !encoded};
  const auto found = session->waitForFrame(query, pollTimeout(context.config, request));
  if (!found && context.stopping) throw stoppingProblem();
  if (!found) return {204, "", "", {}};
  net::Response response{200, std::string(type->mediaType), "", {}};
  const std::uint64_t pixels = std::uint64_t(found->width) * std::uint64_t(found->height);
  if (encoded) {
    response.heldUntilSent = context.answers.take(request.flow, found->jpeg->size());
    response.body.assign(found->jpeg->begin(), found->jpeg->end());
  } else {
    setEncodedBody(
        context, request, (aov ? pixels * sizeof(glm::vec4) : 0) + type->memory(pixels),
        [&](const std::stop_token& stop) {
          if (!aov) return imageBytes(*type, *found->image, found->background, stop);
          const AovValues& values = (*found->aovs)[std::size_t(*aov)];
          const Image image = type->isFloat ? aovImage(values) : aovPicture(values);
          return imageBytes(*type, image, glm::vec3(0), stop);
        },
        response);
  }
  response.headers = {{"Scolopax-Frame", std::to_string(found->info.number)},
                      {"Scolopax-Revision", std::to_string(found->info.revision)},
                      {"Scolopax-Samples", std::to_string(found->info.samples)},
                      {"Scolopax-Error", json(found->info.error).dump()},
                      {"Scolopax-Final", found->info.final ? "1" : "0"},
                      {"Cache-Control", "no-store"}};
  return response;
}

PickQuery pickQuery(const net::Request& request) {
  PickQuery query{queryNumber(request, "x"), queryNumber(request, "y")};
  if (request.queryValue("x2")) query.x2 = queryNumber(request, "x2");
  if (request.queryValue("y2")) query.y2 = queryNumber(request, "y2");
  return query;
}

net::Response pick(ApiContext& context, const net::Request& request) {
  const auto session = sessionOf(context, request);
  const auto found = session->waitForPick(pickQuery(request), context.config.pollTimeout, request.gone);
  if (!found && context.stopping) throw stoppingProblem();
  if (!found)
    throw ProtocolError(503, "",
                        "the pick was not answered within " +
                            shortText(secondsOf(context.config.pollTimeout)) +
                            " seconds: the scene was not ready, or its rays take long");
  return jsonResponse(200, *found);
}

}  // namespace

std::vector<Route> sessionRoutes(ApiContext& context) {
  const Parameter id{"id", "path", "string", "Id of the session"};
  const Parameter ifMatch{"If-Match", "header", "string",
                          "Revision that the edit is meant for; 409 if the scene is at another"};
  const std::vector<std::string> kJson{"application/json"};
  const std::string scenePath = "/api/v1/sessions/{id}/scene";

  return {
      {"POST",
       "/api/v1/sessions",
       "Begins a session with the scene in the body's field scene, or with the default scene",
       {},
       "application/json",
       kJson,
       {},
       [&context](const net::Request& request) { return create(context, request); },
       {201}},
      {"GET",
       "/api/v1/sessions/{id}",
       "Revision, data set, viewers and latest frame of a session",
       {id},
       "",
       kJson,
       {},
       [&context](const net::Request& request) { return describe(context, request); }},
      {"DELETE",
       "/api/v1/sessions/{id}",
       "Ends a session and its streams",
       {id},
       "",
       {},
       {},
       [&context](const net::Request& request) -> net::Response {
         context.sessions.remove(sessionOf(context, request)->id());
         return {204, "", "", {}};
       }},
      {"GET",
       scenePath,
       "The scene with every value resolved, and its revision",
       {id},
       "",
       kJson,
       {},
       [&context](const net::Request& request) {
         const auto state = sessionOf(context, request)->scene();
         return withTag(jsonResponse(200, sceneJson(state)), state);
       }},
      {"PATCH",
       scenePath,
       "Edits the scene by a merge patch (RFC 7396); decimal keys patch elements of lists",
       {id, ifMatch},
       std::string(kMergePatch),
       kJson,
       {},
       [&context](const net::Request& request) {
         const json patch = jsonBody(request, context.config, kMergePatch);
         return edited(context, request, [&](Session& session, const EditOrigin& origin) {
           return session.patch(patch, origin);
         });
       }},
      {"PUT",
       scenePath,
       "Replaces the scene",
       {id, ifMatch},
       "application/json",
       kJson,
       {},
       [&context](const net::Request& request) {
         const json scene = jsonBody(request, context.config);
         return edited(context, request, [&](Session& session, const EditOrigin& origin) {
           return session.replace(scene, origin);
         });
       }},
      {"GET",
       "/api/v1/sessions/{id}/frame",
       "Waits for a picture of the scene as it is now; 204 if none came in time",
       {id,
        {"after", "query", "integer", "Number of the last frame seen; waits for a newer one"},
        {"minSamples", "query", "integer", "Least number of samples per pixel, unless the frame is final"},
        {"format", "query", "string", imageTypesText(&ImageType::format, " (default)")},
        {"aov", "query", "string", "What to return instead of colours, one of " + aovNames()},
        {"timeout", "query", "number",
         "Seconds to wait, at most " + shortText(secondsOf(context.config.pollTimeout)) +
             ", which is the default"}},
       "",
       imageMediaTypes(),
       net::RouteKind::waiting,
       [&context](const net::Request& request) { return frame(context, request); },
       {200, 204}},
      {"GET",
       "/api/v1/sessions/{id}/pick",
       "What is visible at a pixel of the picture, or in a rectangle of it",
       {id,
        {"x", "query", "number", "Pixels from the picture's left edge"},
        {"y", "query", "number", "Pixels from the picture's top edge"},
        {"x2", "query", "number", "With y2: the rectangle's other corner"},
        {"y2", "query", "number", "With x2: the rectangle's other corner"}},
       "",
       kJson,
       net::RouteKind::waiting,
       [&context](const net::Request& request) { return pick(context, request); }},
  };
}

}  // namespace scolopax::server
