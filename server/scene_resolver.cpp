// SPDX-License-Identifier: Apache-2.0
#include "server/scene_resolver.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "protocol/fields.h"
#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/clip_view.h"
#include "renderer/data/colormap.h"
#include "renderer/data/defaults.h"
#include "renderer/data/gradient_histogram.h"
#include "renderer/data/image.h"
#include "renderer/data/scene_checks.h"
#include "renderer/data/surfaces.h"
#include "renderer/data/visible_hull.h"
#include "renderer/renderer.h"
#include "server/encoder.h"
#include "server/hex_color.h"

namespace scolopax::server {
namespace {

// The protocol does not depend on the renderer, so its limits are numbers of its own.
static_assert(protocol::kMaxChannelItems == std::size_t(kMaxChannels));
static_assert(protocol::kMaxLightItems == std::size_t(kernel::kMaxLights));
static_assert(protocol::kMaxIsovalueItems == std::size_t(kernel::kMaxSurfaces));
static_assert(protocol::kMaxClipItems == std::size_t(kernel::kMaxClipPlanes));
static_assert(std::tuple_size_v<decltype(protocol::Crop::regions)> == std::size_t(kernel::kCropRegions));
static_assert(protocol::kMaxSidePixels == std::uint32_t(kMaxImageSide));
static_assert(protocol::kMaxMacrocellVoxels == std::uint32_t(kMaxMacrocell));
static_assert(protocol::kMaxStopSamples == kMaxSamples);

using nlohmann::json;
using protocol::ProtocolError;

/// The value with this wire name, which parseScene has checked.
template <class Enum, std::size_t N>
Enum valueOf(const NamedValue (&list)[N], std::string_view name) {
  return Enum(std::find_if(list, list + N, [&](const NamedValue& value) { return value.name == name; }) -
              list);
}

glm::dvec3 vectorOf(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> arrayOf(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

std::vector<ColorKnot> knotsOf(const protocol::Colormap& colormap) {
  if (const auto* name = std::get_if<std::string>(&colormap)) return colormapKnots(*name);
  std::vector<ColorKnot> knots;
  for (const auto& point : std::get<std::vector<protocol::ColorPoint>>(colormap))
    knots.push_back({point.position, linearOf(point.color)});
  return knots;
}

/// Turns an Error of `check` into a ProtocolError(422), so that an edit is refused that the renderer would
/// refuse later.
template <class Check>
void refuseAt(const std::string& pointer, Check&& check) {
  try {
    check();
  } catch (const Error& error) {
    throw ProtocolError(422, pointer, error.what());
  }
}

void resolveChannels(protocol::Scene& scene, Scene& render, const Volume& volume) {
  const auto channels = volume.channels();
  scene.channels.resize(channels.size());
  for (std::size_t i = 0; i < channels.size(); ++i) {
    protocol::Channel& wire = scene.channels[i];
    ChannelAppearance& look = render.channels.emplace_back();
    if (!wire.name) wire.name = channels[i].name;
    if (!wire.range) {
      const ValueRange range = defaultRange(volume, int(i));
      wire.range = {range.lo, range.hi};
    }
    if (!wire.color && !wire.colormap) {
      if (channels.size() == 1)
        wire.colormap = std::string(kDefaultColormap);
      else
        wire.color = hexOf(defaultColor(int(i)));
    }
    if (!wire.density) wire.density = defaultDensity(volume, int(i));
    look.visible = wire.visible;
    look.rangeLo = (*wire.range)[0];
    look.rangeHi = (*wire.range)[1];
    look.interpolation = valueOf<Interpolation>(kInterpolations, wire.interpolation);
    look.gamma = wire.gamma;
    look.opacity.clear();
    for (const auto& point : wire.opacity) look.opacity.push_back({point.position, point.value});
    look.color = wire.color ? std::vector<ColorKnot>{{0, linearOf(*wire.color)}} : knotsOf(*wire.colormap);
    look.density = *wire.density;
    for (protocol::Isovalue& isovalue : wire.isovalues) {
      if (!isovalue.value) isovalue.value = 0.5 * (*wire.range)[0] + 0.5 * (*wire.range)[1];
      Isovalue& surface = look.isovalues.emplace_back(Isovalue{*isovalue.value, isovalue.opacity, {}});
      if (isovalue.color) surface.color = linearOf(*isovalue.color);
    }
    look.peaks = valueOf<Peaks>(kPeaks, wire.peaks);
    refuseAt("/channels/" + std::to_string(i),
             [&] { Surfaces(channels[i], look, 0, volume.grid().smallestSpacing()); });
    look.weight = wire.weight;
    look.material = {wire.material.ambient, wire.material.diffuse, wire.material.specular,
                     wire.material.shininess};
  }
}

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

void resolveCamera(protocol::Scene& scene, Scene& render, const Grid& grid, std::span<const glm::vec3> seen) {
  const double aspect = double(scene.image.width) / double(scene.image.height);
  const Camera framing = framingCamera(grid, scene.camera.fovY, aspect, seen);
  protocol::Camera& wire = scene.camera;
  if (!wire.eye) wire.eye = arrayOf(framing.eye);
  if (!wire.target) wire.target = arrayOf(framing.target);
  if (!wire.up) wire.up = arrayOf(framing.up);
  render.camera = {vectorOf(*wire.eye), vectorOf(*wire.target), vectorOf(*wire.up), wire.fovY,
                   wire.orthoHeight};
  refuseAt("/camera", [&] { makeCameraRays(render.camera, grid, 1, 1); });
}

void resolveClipping(protocol::Scene& scene, Scene& render, const Volume& volume) {
  const Grid& grid = volume.grid();
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  for (std::size_t i = 0; i < scene.clip.size(); ++i) {
    protocol::ClipPlane& wire = scene.clip[i];
    if (!wire.point) wire.point = arrayOf(centre);
    ClipPlane plane{vectorOf(*wire.point), vectorOf(wire.normal), {}};
    const std::string pointer = "/clip/" + std::to_string(i);
    if (plane.normal == glm::dvec3(0))
      throw ProtocolError(422, pointer + "/normal", "expected a direction that is not 0");
    if (wire.media) plane.channels.emplace(wire.media->begin(), wire.media->end());
    refuseAt(pointer, [&] { checkClipping({&plane, 1}, std::nullopt, volume.channels().size()); });
    render.clip.push_back(std::move(plane));
  }

  protocol::Crop& wire = scene.crop;
  Crop crop{{}, {}, 0};
  for (std::size_t i = 0; i < wire.regions.size(); ++i) crop.regions |= std::uint32_t(wire.regions[i]) << i;
  bool keepsAll = (crop.regions & Crop::kInnermost) != 0;
  const auto resolveAxis = [&](std::optional<std::array<double, 2>>& ends, int axis, const char* name) {
    if (!ends) ends = {-0.5, grid.dims[axis] - 0.5};
    const auto [low, high] = *ends;
    if (low > high)
      throw ProtocolError(422, std::string("/crop/") + name,
                          "expected two numbers, the second not below the first");
    keepsAll = keepsAll && low <= -0.5 && high >= grid.dims[axis] - 0.5;
    crop.low[axis] = low;
    crop.high[axis] = high;
  };
  resolveAxis(wire.x, 0, "x");
  resolveAxis(wire.y, 1, "y");
  resolveAxis(wire.z, 2, "z");
  if (!keepsAll) render.crop = crop;
}

void resolveLights(const protocol::Scene& scene, Scene& render) {
  render.shading = scene.shading;
  render.shadows = scene.shadows;
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const protocol::Light& wire = scene.lights[i];
    Light light{valueOf<LightType>(kLightTypes, wire.type), vectorOf(wire.direction), linearOf(wire.color),
                wire.intensity};
    if (light.type == LightType::directional && light.vector == glm::dvec3(0))
      throw ProtocolError(422, "/lights/" + std::to_string(i) + "/direction",
                          "expected a direction that is not 0");
    if (light.type == LightType::point) light.vector = vectorOf(wire.position);
    refuseAt("/lights/" + std::to_string(i), [&] { checkLight(light); });
    render.lights.push_back(light);
  }
}

/// Refuses small macrocells in a large volume, which cost much and gain little. The default size is always
/// accepted.
void checkMacrocell(int size, const Volume& volume, std::size_t maxIntervals) {
  const auto tooMany = [&](int one) { return intervalCount(volume, one) > maxIntervals; };
  int least = size;
  while (least < Scene().macrocell && tooMany(least)) ++least;
  if (least == size) return;
  throw ProtocolError(
      422, "/integrator/macrocell",
      "expected at least " + std::to_string(least) + " for this data set, found " + std::to_string(size));
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

}  // namespace

bool makeSameFilm(const ResolvedScene& a, const ResolvedScene& b) {
  return a.dataset == b.dataset && makeSameFilm(a.render, b.render);
}

json pictureJson(const protocol::Scene& resolved) {
  json picture = protocol::toJson(pictureOf(resolved));
  picture.erase("stop");
  return picture;
}

SceneResolver::SceneResolver(std::shared_ptr<const DatasetStore> datasets, Options options)
    : datasets_(std::move(datasets)), options_(std::move(options)), lists_(rendererLists()) {
  for (const auto& dataset : datasets_->all())
    coarse_.emplace(dataset.get(), buildCoarseMacrocells(*dataset->volume));
}

void SceneResolver::frame(const protocol::Scene& scene, ResolvedScene& result) const {
  if (result.automatic.framed || (scene.camera.eye && scene.camera.target)) return;
  std::vector<glm::vec3> hull;
  try {
    hull = visibleHull(*result.dataset->volume, coarse_.at(result.dataset.get()), result.render.channels);
  } catch (const Error&) {  // rendering will report the error
  }
  result.automatic.framed = std::make_shared<const std::vector<glm::vec3>>(std::move(hull));
}

std::array<double, 2> SceneResolver::gradientRange(const ResolvedScene& scene, int channel) const {
  const auto gradients = datasets_->gradients(*scene.dataset, channel);
  if (!gradients)
    throw Unmeasured([store = datasets_, dataset = scene.dataset, channel](const std::stop_token& stop) {
      store->measuredGradients(*dataset, channel, stop);
    });
  double most = 0;
  refuseAt("/channels/" + std::to_string(channel), [&] {
    most = gradientQuantile(*gradients, scene.dataset->volume->channels()[std::size_t(channel)],
                            scene.render.channels[std::size_t(channel)], kWithinRange);
  });
  return {0, most > 0 ? most : 1};  // with a gradient of 0, all ranges give the same picture
}

void SceneResolver::resolveGradientOpacity(protocol::Scene& scene, ResolvedScene& result) const {
  auto& ranges = result.automatic.gradientRanges;
  ranges.resize(scene.channels.size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    std::optional<protocol::GradientOpacity>& wire = scene.channels[i].gradientOpacity;
    if (!wire || wire->range) {
      ranges[i].reset();
    } else {
      if (!ranges[i]) ranges[i] = gradientRange(result, int(i));
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
    for (const auto& one : datasets_->all()) known += (known.empty() ? "" : ", ") + one->id;
    const json found = protocol::shortened(id->get_ref<const std::string&>());
    throw ProtocolError(422, "/dataset", "expected one of " + known + ", found " + found.dump());
  }
  return dataset;
}

SceneResolver::Resolved SceneResolver::replaceNow(const json& scene, std::uint32_t defaultSamples) const {
  const auto count = datasetOf(scene)->volume->channels().size();
  return resolve(SparseScene().patched(scene, count), {}, defaultSamples);
}

SceneResolver::Resolved SceneResolver::patchNow(const ResolvedScene& base, const json& patch) const {
  const bool namesDataset = patch.is_object() && patch.contains("dataset");
  const auto count = datasetOf(namesDataset ? patch : base.sparse.rest())->volume->channels().size();
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
  const Volume& volume = *result->dataset->volume;
  protocol::checkChannelCount(scene, volume.channels().size());
  if (std::uint64_t(scene.image.width) * scene.image.height > options_.maxPixels)
    throw ProtocolError(422, "/image",
                        "expected at most " + std::to_string(options_.maxPixels) + " pixels, found " +
                            std::to_string(scene.image.width) + " x " + std::to_string(scene.image.height));
  Scene& render = result->render;
  render.width = int(scene.image.width);
  render.height = int(scene.image.height);
  scene.dataset = result->dataset->id;
  resolveChannels(scene, render, volume);
  if (const auto reason = tooLarge(render, false)) throw ProtocolError(422, "/image", *reason);
  frame(scene, *result);
  const auto& framed = result->automatic.framed;
  resolveCamera(scene, render, volume.grid(), framed ? *framed : std::span<const glm::vec3>());
  resolveClipping(scene, render, volume);
  resolveLights(scene, render);
  render.blend = valueOf<BlendMode>(kBlendModes, scene.blend.mode);
  render.method = valueOf<Method>(kMethods, scene.integrator.method);
  render.macrocell = int(scene.integrator.macrocell);
  checkMacrocell(render.macrocell, volume, options_.maxIntervals);
  render.step = scene.integrator.step;
  refuseAt("/integrator/step", [&] { checkStep(render.step); });
  render.sampling = valueOf<Sampling>(kSamplings, scene.integrator.sampling);
  render.seed = scene.integrator.seed;
  render.background = glm::vec3(linearOf(scene.image.background));
  render.filter = valueOf<PixelFilter>(kPixelFilters, scene.image.filter);
  resolveGradientOpacity(scene, *result);  // late, so that refused scenes are not measured
  refuseAt("", [&] { checkScene(render, volume); });
  if (!scene.stop.samples && !scene.stop.seconds && !scene.stop.error) scene.stop.samples = defaultSamples;
  result->defaultSamples = defaultSamples;
  result->stop = {scene.stop.samples.value_or(0), scene.stop.seconds.value_or(0),
                  scene.stop.error.value_or(0)};
  result->resolved = std::move(scene);
  result->sparse = std::move(sparse);
  return result;
}

}  // namespace scolopax::server
