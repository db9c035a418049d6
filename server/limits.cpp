// SPDX-License-Identifier: Apache-2.0
#include "server/limits.h"

#include <nlohmann/json.hpp>
#include <type_traits>

#include "renderer/core/short_text.h"
#include "renderer/data/pick.h"
#include "renderer/data/scene.h"
#include "server/edit_queue.h"
#include "server/pick_queue.h"
#include "server/scene_resolver.h"
#include "server/session.h"

namespace scolopax::server {
namespace {

constexpr Limit kLimits[] = {
    {"bodyBytes", "bytes of one request's body", "413", &Config::maxBodyBytes, "max-body"},
    {"messageBytes", "bytes of one text message in a stream", "closed with 1009", &Config::maxMessageBytes,
     "max-message"},
    {"sceneDepth", "depth to which lists and objects are nested", "400", &Config::maxJsonDepth,
     "max-json-depth"},
    {"imageWidth", "width of one picture", "422", std::uint64_t(kMaxImageSide)},
    {"imageHeight", "height of one picture", "422", std::uint64_t(kMaxImageSide)},
    {"imagePixels", "pixels of one picture: width times height", "422", &Config::maxPixels, "max-image"},
    {"sessions", "sessions at a time; shared among addresses", "503", &Config::maxSessions, "max-sessions"},
    {"clients", "streams at a time; shared among addresses", "503", &Config::maxClients, "max-clients"},
    {"renderSeconds", "seconds of one POST api/v1/render or one pick", "422", &Config::maxRenderSeconds,
     "max-render-seconds"},
    {"renders",
     "POST api/v1/render that render at a time; shared among addresses; those that wait to be encoded do not "
     "count",
     "503", &Config::maxRenders, "max-renders"},
    {"macrocells",
     "macrocells of a data set, counted once for each channel, if they are smaller than 4 voxels", "422",
     std::uint64_t(SceneResolver::kMaxIntervals)},
    {"memoryBytes", "bytes of memory, besides the data sets; see below", "422 or 503",
     &Config::maxMemoryBytes, "max-memory", "a quarter of the machine's"},
    {"waitingPolls", "GET .../frame that wait on one session", "429", std::uint64_t(Session::kMaxPolls)},
    {"waitingPicks", "picks that wait on one session", "429", std::uint64_t(PickQueue::kMaxPicks)},
    {"waitingEdits", "edits of one stream that wait for a measurement", "429",
     std::uint64_t(EditQueue::kMaxEdits)},
    {"pickPixels", "pixels that one pick samples", "a lattice of them is sampled",
     std::uint64_t(kMaxPickPixels)},
};

/// Calls f with the limit's value.
template <class F>
auto withValue(const Limit& limit, const Config& config, F&& f) {
  return std::visit(
      [&](auto value) {
        if constexpr (std::is_member_pointer_v<decltype(value)>)
          return f(config.*value);
        else
          return f(value);
      },
      limit.value);
}

}  // namespace

std::span<const Limit> limits() { return kLimits; }

nlohmann::json limitsJson(const Config& config) {
  nlohmann::json values = nlohmann::json::object();
  for (const Limit& limit : kLimits)
    values[std::string(limit.name)] =
        withValue(limit, config, [](auto value) { return nlohmann::json(value); });
  return values;
}

std::string limitsMarkdown() {
  std::string table = "| limit | of | default | option | when exceeded |\n|---|---|---|---|---|\n";
  const auto cell = [&](std::string_view text) { table.append(" ").append(text).append(" |"); };
  const Config defaults;
  for (const Limit& limit : kLimits) {
    table += '|';
    cell('`' + std::string(limit.name) + '`');
    cell(limit.of);
    cell(limit.defaultWords.empty() ? withValue(limit, defaults,
                                                [](auto value) {
                                                  if constexpr (std::is_floating_point_v<decltype(value)>)
                                                    return shortText(value);
                                                  else
                                                    return std::to_string(value);
                                                })
                                    : std::string(limit.defaultWords));
    cell(limit.option.empty() ? "fixed" : "`--" + std::string(limit.option) + '`');
    cell(limit.whenExceeded);
    table += '\n';
  }
  return table + '\n';
}

}  // namespace scolopax::server
