// SPDX-License-Identifier: Apache-2.0
#include "server/scene_resolver.h"

#include <span>
#include <string>
#include <utility>

#include "protocol/fields.h"
#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/gradient_histogram.h"
#include "renderer/data/image.h"
#include "renderer/data/scene_checks.h"
#include "renderer/data/visible_hull.h"
#include "renderer/renderer.h"
#include "server/encoder.h"
#include "server/resolve/parts.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using protocol::ProtocolError;

static_assert(protocol::kMaxStopSamples == kMaxSamples);

/// The automatic range includes the gradients of this share of the voxels that have opacity.
constexpr double kWithinRange = 0.995;

/// Whether a patch, which has been applied, asks for a new automatic range of a channel's gradients.
bool resetsGradientRange(const json& patch, std::size_t channel) {
  const auto channels = patch.find("channels");
  if (channels == patch.end()) return false;
  if (!channels->is_object()) return true;  // all channels are replaced
  const auto entry = channels->find(std::to_string(channel));
  if (entry == channels->end()) return false;
  if (!entry->is_object()) return true;
  const auto curve = entry->find("gradientOpacity");
  if (curve == entry->end()) return false;
  return !curve->is_object() || (curve->contains("range") && (*curve)["range"].is_null());
}

/// Whether a patch asks for a new automatic view.
bool resetsView(const json& patch) {
  if (!patch.is_object()) return false;
  const auto camera = patch.find("camera");
  if (camera == patch.end()) return false;
  const auto isNull = [&](const char* name) { return camera->contains(name) && (*camera)[name].is_null(); };
  return camera->is_null() || (camera->is_object() && (isNull("eye") || isNull("target")));
}

/// Bytes of memory that the curves of a scene take in all forms of a ResolvedScene.
std::uint64_t curveBytes(const protocol::Scene& scene) {
  // In JSON, a control point is a list of its own, in three allocations; a colour is another.
  constexpr std::uint64_t kPoint = 96 + sizeof(protocol::ControlPoint) + sizeof(OpacityKnot),
                          kColorPoint = 96 + 48 + sizeof(protocol::ColorPoint) + sizeof(ColorKnot);
  std::uint64_t points = 0, colors = 0;
  for (const protocol::Channel& channel : scene.channels) {
    points += channel.opacity.size();
    if (channel.gradientOpacity) points += channel.gradientOpacity->points.size();
    const auto* colormap = channel.colormap ? std::get_if<1>(&*channel.colormap) : nullptr;
    if (colormap) colors += colormap->size();
  }
  return points * kPoint + colors * kColorPoint;
}

/// Removes everything that does not affect the picture.
protocol::Scene pictureOf(protocol::Scene resolved) {
  resolved.stop = {};
  for (protocol::Channel& channel : resolved.channels) channel.name.reset();
  return resolved;
}

/// Throws Unmeasured if nothing of the data set has been loaded.
std::shared_ptr<const DatasetFacts> factsOf(const ResolvedScene& scene) {
  auto facts = scene.dataset->facts();
  if (!facts)
    throw Unmeasured([dataset = scene.dataset, time = scene.time](const std::stop_token& stop) {
      dataset->factsOrLoad(stop, time);
    });
  return facts;
}

}  // namespace

bool makeSameFilm(const ResolvedScene& a, const ResolvedScene& b) {
  return a.dataset == b.dataset && a.time == b.time && makeSameFilm(a.render, b.render);
}

json pictureJson(const protocol::Scene& resolved) {
  json picture = protocol::toJson(pictureOf(resolved));
  picture.erase("stop");
  return picture;
}

SceneResolver::SceneResolver(std::shared_ptr<const DatasetStore> datasets, Options options)
    : datasets_(std::move(datasets)), options_(std::move(options)), lists_(rendererLists()) {}

void SceneResolver::frame(const protocol::Scene& scene, const DatasetFacts& facts,
                          ResolvedScene& result) const {
  if (result.automatic.framed || (scene.camera.eye && scene.camera.target)) return;
  std::vector<glm::vec3> hull;
  try {
    hull = visibleHull(facts.volume, facts.coarse, result.render.channels);
  } catch (const Error&) {  // rendering will report the error
  }
  result.automatic.framed = std::make_shared<const std::vector<glm::vec3>>(std::move(hull));
}

std::array<double, 2> SceneResolver::gradientRange(const VolumeFacts& volume, const ResolvedScene& scene,
                                                   int channel) const {
  const auto gradients = datasets_->gradients(*scene.dataset, channel);
  if (!gradients)
    throw Unmeasured([store = datasets_, dataset = scene.dataset, channel](const std::stop_token& stop) {
      store->measuredGradients(*dataset, channel, stop);
    });
  double most = 0;
  refuseAt("/channels/" + std::to_string(channel), [&] {
    most = gradientQuantile(*gradients, volume.channels[std::size_t(channel)],
                            scene.render.channels[std::size_t(channel)], kWithinRange);
  });
  return {0, most > 0 ? most : 1};  // with a gradient of 0, all ranges give the same picture
}

void SceneResolver::resolveGradientOpacity(const VolumeFacts& volume, protocol::Scene& scene,
                                           ResolvedScene& result) const {
  auto& ranges = result.automatic.gradientRanges;
  ranges.resize(scene.channels.size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    std::optional<protocol::GradientOpacity>& wire = scene.channels[i].gradientOpacity;
    if (!wire || wire->range) {
      ranges[i].reset();
    } else {
      if (!ranges[i]) ranges[i] = gradientRange(volume, result, int(i));
      wire->range = ranges[i];
    }
    if (!wire) continue;
    GradientOpacity& look = result.render.channels[i].gradientOpacity.emplace();
    look.rangeLo = (*wire->range)[0];
    look.rangeHi = (*wire->range)[1];
    look.factor.clear();
    for (const auto& point : wire->points) look.factor.push_back({point.position, point.value});
  }
}

std::shared_ptr<const Dataset> SceneResolver::datasetOf(const json& scene) const {
  const auto id = scene.is_object() ? scene.find("dataset") : scene.end();
  // parseScene refuses anything but a name, with a better message.
  if (id == scene.end() || !id->is_string()) return datasets_->first();
  auto dataset = datasets_->find(id->get_ref<const std::string&>());
  if (!dataset) {
    std::string known;
    for (const auto& one : datasets_->all()) known += (known.empty() ? "" : ", ") + one->id();
    const json found = protocol::shortened(id->get_ref<const std::string&>());
    throw ProtocolError(422, "/dataset", "expected one of " + known + ", found " + found.dump());
  }
  return dataset;
}

SceneResolver::Resolved SceneResolver::replaceNow(const json& scene, std::uint32_t defaultSamples) const {
  const auto count = datasetOf(scene)->headers().channels.size();
  return resolve(SparseScene().patched(scene, count), {}, defaultSamples);
}

SceneResolver::Resolved SceneResolver::patchNow(const ResolvedScene& base, const json& patch) const {
  const bool namesDataset = patch.is_object() && patch.contains("dataset");
  const auto count = datasetOf(namesDataset ? patch : base.sparse.rest())->headers().channels.size();
  SparseScene sparse = base.sparse.patched(patch, count);
  AutomaticValues automatic = base.automatic;
  if (resetsView(patch)) automatic.framed.reset();
  for (std::size_t i = 0; i < automatic.gradientRanges.size(); ++i)
    if (resetsGradientRange(patch, i)) automatic.gradientRanges[i].reset();
  return resolve(std::move(sparse), automatic, base.defaultSamples);
}

SceneResolver::Resolved SceneResolver::replace(const json& scene, const std::stop_token& stop,
                                               std::uint32_t defaultSamples) const {
  return whenMeasured(stop, [&] { return replaceNow(scene, defaultSamples); });
}

SceneResolver::Resolved SceneResolver::patch(const ResolvedScene& base, const json& patch,
                                             const std::stop_token& stop) const {
  return whenMeasured(stop, [&] { return patchNow(base, patch); });
}

std::optional<std::string> SceneResolver::tooLarge(const Scene& scene, bool aovs) const {
  if (!options_.memory) return std::nullopt;
  const std::uint64_t pixels = std::uint64_t(scene.width) * std::uint64_t(scene.height);
  // Everything that a session holds at the same time when it shows its first picture.
  const std::uint64_t parts[] = {pixels * filmPixelBytes(scene.channels.size(), aovs),
                                 pixels * sizeof(glm::vec4),
                                 aovs ? pixels * std::size(kAovs) * sizeof(float) : 0, jpegMemory(pixels)};
  std::uint64_t held = 0;
  for (const std::uint64_t part : parts) {
    held += part;
    const std::uint64_t most = options_.memory->most(part);
    if (held <= most) continue;
    return "expected a picture that needs at most " + mebibytes(most) + " of memory, found " +
           std::to_string(scene.width) + " x " + std::to_string(scene.height) + " pixels, which need " +
           mebibytes(held) + (aovs ? " with this quantity" : "");
  }
  return std::nullopt;
}

SceneResolver::Resolved SceneResolver::resolve(SparseScene sparse, const AutomaticValues& automatic,
                                               std::uint32_t defaultSamples) const {
  protocol::Scene scene = sparse.parsed(lists_);
  auto result = std::make_shared<ResolvedScene>();
  if (const std::uint64_t bytes = curveBytes(scene); bytes > MemoryBudget::kFreeBytes)
    result->memory = MemoryBudget::take(options_.memory, MemoryUse::scenes, bytes);
  result->dataset = datasetOf(sparse.rest());
  if (automatic.dataset == result->dataset) result->automatic = automatic;
  result->automatic.dataset = result->dataset;
  protocol::checkChannelCount(scene, result->dataset->headers().channels.size());
  result->time = result->dataset->stepAt(scene.time);
  scene.time = std::uint32_t(result->time);
  const auto facts = factsOf(*result);
  const VolumeFacts& volume = facts->volume;
  Scene& render = result->render;
  resolveImage(scene, render, options_.maxPixels);
  scene.dataset = result->dataset->id();
  resolveChannels(scene, render, volume);
  if (const auto reason = tooLarge(render, false)) throw ProtocolError(422, "/image", *reason);
  frame(scene, *facts, *result);
  const auto& framed = result->automatic.framed;
  resolveCamera(scene, render, volume.grid, framed ? *framed : std::span<const glm::vec3>());
  resolveClipping(scene, render, volume);
  resolveLights(scene, render);
  resolveIntegrator(scene, render, volume, options_.maxIntervals);
  resolveGradientOpacity(volume, scene, *result);  // late, so that refused scenes are not measured
  refuseAt("", [&] { checkScene(render, volume.channels.size()); });
  if (!scene.stop.samples && !scene.stop.seconds && !scene.stop.error) scene.stop.samples = defaultSamples;
  result->defaultSamples = defaultSamples;
  result->stop = {scene.stop.samples.value_or(0), scene.stop.seconds.value_or(0),
                  scene.stop.error.value_or(0)};
  result->resolved = std::move(scene);
  result->sparse = std::move(sparse);
  return result;
}

}  // namespace scolopax::server
