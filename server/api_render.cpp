// SPDX-License-Identifier: Apache-2.0
// POST /render: returns a picture of a scene and keeps nothing.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "server/api.h"
#include "server/fair_places.h"
#include "server/stop_rule.h"

namespace scolopax::server {
namespace {

using protocol::ProtocolError;

/// Seconds for which a pass runs before it is checked whether the picture is still wanted.
constexpr double kSlice = 0.1;
/// Seconds; can be added to a clock's time without overflow.
constexpr double kForever = 1e9;

/// The value of the header Scolopax-Corrections.
std::string textOf(const std::vector<Choice::Correction>& corrections) {
  std::string text;
  for (const Choice::Correction& level : corrections) {
    if (!text.empty()) text += ',';
    text += shortText(level.step);
    text += ':';
    text += std::to_string(level.passes);
  }
  return text;
}

using Clock = std::chrono::steady_clock;

/// Aborts a render when its client disconnects, the server stops, or its time is over.
class AbortSignal {
 public:
  AbortSignal(const std::stop_token& gone, const std::stop_token& abort, double seconds)
      : gone_(gone, Request{this}),
        abort_(abort, Request{this}),
        timer_([this, seconds](const std::stop_token& over) { endAfter(seconds, over); }) {}
  std::stop_token token() const { return source_.get_token(); }
  const std::atomic<bool>& flag() const { return flag_; }

 private:
  struct Request {
    AbortSignal* signal;
    void operator()() const {
      signal->flag_ = true;
      signal->source_.request_stop();
    }
  };
  void endAfter(double seconds, const std::stop_token& over) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any never;
    const std::chrono::duration<double> most(std::min(seconds, kForever));
    never.wait_for(lock, over, std::chrono::duration_cast<Clock::duration>(most), [] { return false; });
    if (!over.stop_requested()) Request{this}();
  }

  std::stop_source source_;
  std::atomic<bool> flag_{false};
  std::stop_callback<Request> gone_, abort_;
  std::jthread timer_;
};

/// Returns work(), or nullopt if it was cancelled.
template <class Work>
auto unlessStopped(Work work) -> std::optional<decltype(work())> {
  try {
    return work();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) throw;
    return std::nullopt;
  }
}

/// The renderer's estimated error; NaN if `stop` was requested before it was known.
double errorOf(const Renderer& renderer, const std::stop_token& stop) {
  return unlessStopped([&] { return renderer.estimatedError(stop); })
      .value_or(std::numeric_limits<double>::quiet_NaN());
}

void throwIfUnwanted(const ApiContext& context, const net::Request& request) {
  if (request.gone.stop_requested() || context.abortRequests.stop_requested()) throw unwantedProblem(request);
}

/// The error for a render that is too slow. An incomplete picture, which depends on the machine's speed, is
/// returned only if the scene asks for it.
ProtocolError tooLate(double limit, std::uint32_t samples) {
  return ProtocolError(
      422, "/stop",
      "the render did not finish within " + shortText(limit) + " seconds; " + std::to_string(samples) +
          " samples were done by then; request fewer samples or pixels, or set stop.seconds");
}

/// A scene, and the voxels that it shows.
struct SceneAndVolume {
  std::shared_ptr<const ResolvedScene> scene;
  std::shared_ptr<const Volume> volume;
};

/// The scene in the body. The data that it needs is loaded and measured first, which does not count as
/// rendering.
SceneAndVolume sceneOf(const ApiContext& context, const net::Request& request) {
  const auto body = jsonBody(request, context.config);
  const AbortSignal signal(request.gone, context.abortRequests, kForever);
  const auto found = unlessStopped([&]() -> SceneAndVolume {
    const auto scene = context.renderResolver.replace(body, signal.token());
    return {scene, scene->dataset->load(scene->time, signal.token())};
  });
  if (!found) throw unwantedProblem(request);
  return *found;
}

std::uint64_t pixelsOf(const ResolvedScene& scene) {
  return std::uint64_t(scene.render.width) * std::uint64_t(scene.render.height);
}

/// FNV-1a hash, 64 bits, of the resolved scene's canonical text. Equal pictures have equal hashes.
std::string sceneHash(const ResolvedScene& scene) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : pictureJson(scene.resolved).dump()) hash = (hash ^ std::uint8_t(c)) * 0x100000001b3u;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

struct Rendered {
  std::shared_ptr<const Image> image;        ///< charged to the budget
  decltype(net::Response::headers) headers;  ///< state how it was made
};

/// The picture of the scene, whose stop.seconds is at most the server's limit. The place and the memory of
/// the film are free again when this returns.
Rendered renderPicture(const ApiContext& context, FairPlaces& places, const net::Request& request,
                       const SceneAndVolume& made) {
  const auto& scene = made.scene;
  const double limit = context.config.maxRenderSeconds;
  const FairPlaces::Place place = places.take(request.remoteAddress);
  if (!place) throw protocol::limitReached(503, places.most(), "renders at once");
  const auto begin = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  const auto renderer = context.makeRenderer(made.volume);
  const AbortSignal signal(request.gone, context.abortRequests, limit);
  const auto rebuild = unlessStopped([&] { return renderer->setScene(scene->render, signal.token()); });
  if (!rebuild) {
    throwIfUnwanted(context, request);
    throw tooLate(limit, 0);
  }
  while (!stopMet(scene->stop, *renderer, seconds())) {
    // The scene's time limit may end a pass in the middle, except the first one, which may take up to the
    // server's limit.
    const bool timed = scene->stop.seconds > 0 && renderer->samples() > 0;
    const double until = timed ? scene->stop.seconds : limit;
    // Clamped before the conversion, because a long duration would overflow nanoseconds.
    const auto budget = std::chrono::duration<double>(std::clamp(until - seconds(), 0.0, kSlice));
    const auto slice = std::chrono::duration_cast<std::chrono::nanoseconds>(budget);
    if (renderer->renderSample(signal.flag(), slice)) {
      unlessStopped([&] { return measureFor(scene->stop, *renderer, signal.token()), true; });
      continue;
    }
    throwIfUnwanted(context, request);
    if (seconds() < until) continue;
    if (timed) break;
    throw tooLate(limit, renderer->samples());
  }
  const auto milliseconds = std::int64_t(seconds() * 1000);
  const std::string error = nlohmann::json(errorOf(*renderer, signal.token())).dump();
  throwIfUnwanted(context, request);
  auto memory = MemoryBudget::take(context.memory, MemoryUse::pictures, pixelsOf(*scene) * sizeof(glm::vec4));
  const Choice choice = renderer->choice();
  return {withShare(std::move(memory), renderer->image()),
          {{"Scolopax-Samples", std::to_string(renderer->samples())},
           {"Scolopax-Error", error},
           {"Scolopax-Seed", std::to_string(scene->render.seed)},
           {"Scolopax-Method", std::string(nameOf(choice.method))},
           {"Scolopax-Step", shortText(choice.step)},
           {"Scolopax-Corrections", textOf(choice.corrections)},
           {"Scolopax-Scene", sceneHash(*scene)},
           {"Scolopax-Render-Ms", std::to_string(milliseconds)},
           {"Scolopax-Rebuild-Ms", std::to_string(std::int64_t(rebuild->rebuildMs))},
           {"Vary", "Accept"}}};
}

net::Response render(ApiContext& context, FairPlaces& places, const net::Request& request) {
  const ImageType* type = acceptedImageType(request.header("accept"));
  if (!type)
    throw ProtocolError(406, "",
                        "expected Accept to include " + imageTypesText(&ImageType::mediaType) + ", found " +
                            protocol::shortened(*request.header("accept")));
  const double limit = context.config.maxRenderSeconds;
  const SceneAndVolume made = sceneOf(context, request);
  const auto& scene = made.scene;
  if (scene->stop.seconds > limit)
    throw ProtocolError(422, "/stop/seconds",
                        "expected at most " + shortText(limit) + ", found " + shortText(scene->stop.seconds));
  Rendered rendered = renderPicture(context, places, request, made);
  net::Response response{200, std::string(type->mediaType), "", std::move(rendered.headers)};
  setEncodedBody(
      context, request, type->memory(pixelsOf(*scene)),
      [&](const std::stop_token& stop) {
        return imageBytes(*type, *rendered.image, scene->render.background, stop);
      },
      response);
  return response;
}

}  // namespace

std::vector<Route> renderRoutes(ApiContext& context) {
  const auto places = std::make_shared<FairPlaces>(std::size_t(context.config.maxRenders), context.now);
  return {{"POST",
           "/api/v1/render",
           "A picture of a scene; the same scene gives the same bytes",
           {{"Accept", "header", "string", imageTypesText(&ImageType::mediaType)}},
           "application/json",
           imageMediaTypes(),
           net::RouteKind::takesLong,
           [&context, places](const net::Request& request) { return render(context, *places, request); }}};
}

}  // namespace scolopax::server
