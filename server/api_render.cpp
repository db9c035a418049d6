// SPDX-License-Identifier: Apache-2.0
// POST /render: scene in, picture out, nothing kept.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "renderer/core/short_text.h"
#include "server/api.h"

namespace scolopax::server {
namespace {

using protocol::ProtocolError;

/// How long a pass goes on before it is asked whether anybody still waits for the picture.
constexpr std::chrono::nanoseconds kSlice = std::chrono::milliseconds(100);

/// A place among the renders that may run at once.
class RenderPlace {
 public:
  RenderPlace(std::atomic<int>& running, int limit) : running_(running) {
    if (++running_ <= limit) return;
    --running_;
    throw ProtocolError(503, "",
                        "expected at most " + std::to_string(limit) + " renders at once, found another");
  }
  ~RenderPlace() { --running_; }
  RenderPlace(const RenderPlace&) = delete;
  RenderPlace& operator=(const RenderPlace&) = delete;

 private:
  std::atomic<int>& running_;
};

/// FNV-1a, 64 bits, of the resolved scene's canonical text: equal pictures have equal hashes.
std::string sceneHash(const ResolvedScene& scene) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : scene.picture.dump()) hash = (hash ^ std::uint8_t(c)) * 0x100000001b3u;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

net::Response render(ApiContext& context, std::atomic<int>& running, const net::Request& request) {
  const ImageType* type = acceptedImageType(request.header("accept"));
  if (!type)
    throw ProtocolError(
        406, "",
        "expected Accept to hold image/jpeg, image/png or image/x-exr, found " + *request.header("accept"));
  const double limit = context.config.maxRenderSeconds;
  const auto scene = context.renderResolver.replace(jsonBody(request, context.config));
  if (scene->stop.seconds > limit)
    throw ProtocolError(422, "/stop/seconds",
                        "expected at most " + shortText(limit) + ", found " + shortText(scene->stop.seconds));
  const RenderPlace place(running, context.config.maxRenders);

  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const auto renderer = context.makeRenderer(scene->dataset->volume);
  const RebuildStats rebuild = renderer->setScene(scene->render);
  while (!stopMet(scene->stop, *renderer, seconds())) {
    if (request.gone && *request.gone) throw ProtocolError(503, "", "the client has gone");
    // A rule of time may end a pass in the middle; the first sample is given more, up to the server's own
    // limit.
    const bool timed = scene->stop.seconds > 0 && renderer->samples() > 0;
    const double until = timed ? std::min(scene->stop.seconds, limit) : limit;
    const auto budget = std::chrono::duration<double>(std::max(until - seconds(), 0.0));
    const auto slice = std::min(std::chrono::duration_cast<std::chrono::nanoseconds>(budget), kSlice);
    if (renderer->renderSample(context.cutting, slice)) continue;
    if (context.cutting) throw ProtocolError(503, "", "the server is stopping");
    if (seconds() < until) continue;
    if (timed && until < limit) break;
    // A picture that depends on the machine's speed is only for those who asked for it.
    throw ProtocolError(422, "/stop",
                        "expected to end within " + shortText(limit) + " seconds, found " +
                            std::to_string(renderer->samples()) +
                            " samples done by then; ask for less, or set stop.seconds");
  }
  const auto milliseconds = std::int64_t(seconds() * 1000);
  const std::string error = nlohmann::json(renderer->estimatedError()).dump();
  net::Response response{200,
                         std::string(type->mediaType),
                         imageBytes(renderer->image(), scene->render.background, type->format),
                         {}};
  response.headers = {{"Scolopax-Samples", std::to_string(renderer->samples())},
                      {"Scolopax-Error", error},
                      {"Scolopax-Seed", std::to_string(scene->render.seed)},
                      {"Scolopax-Method", std::string(nameOf(renderer->choice().method))},
                      {"Scolopax-Step", shortText(renderer->choice().step)},
                      {"Scolopax-Scene", sceneHash(*scene)},
                      {"Scolopax-Render-Ms", std::to_string(milliseconds)},
                      {"Scolopax-Rebuild-Ms", std::to_string(std::int64_t(rebuild.rebuildMs))},
                      {"Vary", "Accept"}};
  return response;
}

}  // namespace

std::vector<Route> renderRoutes(ApiContext& context) {
  std::vector<std::string> types;
  for (const ImageType& type : kImageTypes) types.emplace_back(type.mediaType);
  auto running = std::make_shared<std::atomic<int>>(0);
  return {{"POST",
           "/api/v1/render",
           "A picture of a scene; the same scene gives the same bytes",
           {{"Accept", "header", "string", "image/jpeg, image/png or image/x-exr"}},
           "application/json",
           types,
           net::RouteKind::slow,
           [&context, running](const net::Request& request) { return render(context, *running, request); }}};
}

}  // namespace scolopax::server
