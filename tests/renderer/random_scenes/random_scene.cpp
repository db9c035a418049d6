// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/random_scenes/random_scene.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "server/scene_resolver.h"
#include "tests/renderer/random_scenes/draw.h"
#include "tests/support/gradients.h"

namespace scolopax::random_scenes {
namespace {

using nlohmann::json;

/// Everything on which the value of a field may depend.
struct Surroundings {
  std::uint64_t scene;
  const Grid& grid;
  glm::dvec3 corner, edge[3];  // the box in world space
  std::size_t channels = 0;    // of the volume
  const ChannelSource* channel = nullptr;

  glm::dvec3 point(const glm::dvec3& share) const {
    return corner + edge[0] * share.x + edge[1] * share.y + edge[2] * share.z;
  }
};

/// A field of the scene. `draw` returns the members that it sets; an empty object leaves the default.
struct Field {
  const char* name;
  json (*draw)(Draw&, const Surroundings&);
};

json arrayOf(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

template <std::size_t N>
json nameFrom(Draw& draw, const NamedValue (&list)[N]) {
  return list[draw.bits() % N].name;
}

/// 1 to 6 non-decreasing positions in [0, 1], sometimes equal (jumps), and sometimes exactly 0 or 1.
std::vector<double> drawPositions(Draw& draw) {
  std::vector<double> positions;
  const int count = draw.integer(1, 6);
  for (int i = 0; i < count; ++i) positions.push_back(draw.chance(0.2) ? draw.integer(0, 1) : draw.uniform());
  std::sort(positions.begin(), positions.end());
  for (std::size_t i = 1; i < positions.size(); ++i) {
    if (draw.chance(0.25)) positions[i] = positions[i - 1];
    if (draw.chance(0.1)) positions[i] = std::min(1.0, positions[i - 1] + draw.decades(1e-4, 1e-2));
    positions[i] = std::max(positions[i], positions[i - 1]);
  }
  return positions;
}

json drawPoints(Draw& draw) {
  json points = json::array();
  double last = draw.uniform();
  for (const double position : drawPositions(draw)) {
    if (!draw.chance(0.25)) last = draw.chance(0.35) ? draw.integer(0, 1) : draw.uniform();  // else a plateau
    points.push_back({position, last});
  }
  return points;
}

json drawOpacity(Draw& draw, const Surroundings&) {
  if (draw.chance(0.1)) return json::object();
  return {{"opacity", drawPoints(draw)}};
}

/// A range of gradients that the channel has, but without a jump at exactly one of them: where the gradient
/// is constant in a region, rounding would decide on which side of the jump it lies.
json drawGradientOpacity(Draw& draw, const Surroundings& around) {
  if (draw.chance(0.8)) return draw.chance(0.5) ? json::object() : json{{"gradientOpacity", nullptr}};
  json opacity = json::object();
  const std::vector<double> all = test::gradientMagnitudes(around.grid, *around.channel);
  if (all.empty() || draw.chance(0.15)) return {{"gradientOpacity", opacity}};
  json points = drawPoints(draw);
  if (draw.chance(0.1)) points = json::array({points[0]});  // one factor for all gradients
  const double most = all.back() > 0 ? all.back() : 1;
  const auto near = [&] { return draw.oneOf(all) * draw.between(0.8, 1.2); };
  const int kind = draw.integer(0, 19);
  double a = kind > 8 ? near() : 0, b = kind > 8 ? near() : most * draw.between(0.2, 1.2);
  if (kind <= 1) a = b;  // a step
  if (kind == 19) b = a + most * draw.decades(1e-4, 1e-1);
  if (kind % 4 == 3) std::swap(a, b);
  opacity["range"] = {a, b};
  opacity["points"] = points;
  return {{"gradientOpacity", opacity}};
}

/// Data values of the channel's finite voxels.
std::vector<double> valuesOf(const ChannelSource& channel) {
  std::vector<double> values;
  visitScalarType(channel.voxels.type(), [&](auto zero) {
    for (const auto voxel : channel.voxels.as<decltype(zero)>())
      if (std::isfinite(double(voxel))) values.push_back(channel.slope * double(voxel) + channel.intercept);
  });
  return values;
}

/// Values between the voxels' and exactly at them, and some beyond.
json drawIsovalues(Draw& draw, const Surroundings& around) {
  const std::vector<double> values = valuesOf(*around.channel);
  if (values.empty() || draw.chance(0.75)) return json::object();
  const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
  json list = json::array();
  for (int left = draw.integer(1, 3); left > 0; --left) {
    json one = json::object();
    if (!draw.chance(0.05))
      one["value"] = draw.chance(0.3) ? draw.oneOf(values) : draw.between(1.05 * *lo - 0.05 * *hi, *hi);
    if (!draw.chance(0.2)) one["opacity"] = draw.chance(0.2) ? double(draw.integer(0, 1)) : draw.uniform();
    if (draw.chance(0.5)) one["color"] = draw.hexColor();
    if (!list.empty() && draw.chance(0.1)) one = list[0];
    list.push_back(one);
  }
  return {{"isovalues", list}};
}

json drawColor(Draw& draw, const Surroundings&) {
  if (draw.chance(0.05)) return json::object();
  if (draw.chance(0.4)) return {{"color", draw.hexColor()}};
  if (draw.chance(0.1)) return {{"colormap", draw.oneOf<std::string>({"viridis", "fire", "turbo"})}};
  json points = json::array();
  for (const double position : drawPositions(draw)) points.push_back({position, draw.hexColor()});
  return {{"colormap", points}};
}

json drawRange(Draw& draw, const Surroundings& around) {
  double lo = std::numeric_limits<double>::infinity(), hi = -lo;
  const std::vector<double> values = valuesOf(*around.channel);
  if (values.empty() || draw.chance(0.1)) return json::object();
  for (const double value : values) lo = std::min(lo, value), hi = std::max(hi, value);
  const int kind = draw.integer(0, 19);
  if (kind == 0) {  // a step, sometimes exactly at a voxel's value
    const double value = draw.chance(0.5) ? draw.oneOf(values) : draw.between(lo, hi);
    return {{"range", {value, value}}};
  }
  const double width = hi > lo ? hi - lo : std::max(1.0, std::abs(lo));
  double a = lo, b = hi > lo ? hi : lo + width;
  if (kind > 6) a = draw.between(lo - 0.3 * width, hi), b = draw.between(lo, hi + 0.3 * width);
  if (kind == 19) b = a + width * draw.decades(1e-3, 1e-1);
  if (kind % 4 == 3) std::swap(a, b);
  return {{"range", {a, b}}};
}

json drawDensity(Draw& draw, const Surroundings& around) {
  const int kind = draw.integer(0, 19);
  if (kind == 0) return json::object();
  if (kind == 1) return {{"density", 0}};
  // With a number shared by several channels, their extinctions may be equal.
  Draw shared(around.scene, "shared density");
  Draw& from = kind <= 3 ? shared : draw;
  const double thickness = from.chance(0.15) ? from.decades(1e-4, 1e5) : from.decades(1e-2, 1e2);
  return {{"density", thickness / around.grid.diagonal()}};
}

const Field kChannelFields[] = {
    {"visible",
     [](Draw& d, const Surroundings&) -> json {
       return {{"visible", d.chance(0.92)}};
     }},
    {"range", drawRange},
    {"interpolation",
     [](Draw& d, const Surroundings&) -> json {
       return d.chance(0.75) ? json::object() : json{{"interpolation", nameFrom(d, kInterpolations)}};
     }},
    {"color", drawColor},
    {"opacity", drawOpacity},
    {"gamma",
     [](Draw& d, const Surroundings&) -> json {
       return {{"gamma", d.chance(0.6) ? 1 : d.decades(0.2, 5)}};
     }},
    {"density", drawDensity},
    {"weight",
     [](Draw& d, const Surroundings&) -> json {
       return {{"weight", d.chance(0.2) ? double(d.integer(0, 1)) : d.decades(0.05, 5)}};
     }},
    {"material",
     [](Draw& d, const Surroundings&) -> json {
       const auto share = [&] { return d.chance(0.15) ? double(d.integer(0, 1)) : d.between(0, 1.2); };
       const double ambient = share(), diffuse = share(), specular = share();
       return {{"material",
                {{"ambient", ambient},
                 {"diffuse", diffuse},
                 {"specular", specular},
                 {"shininess", d.decades(0.5, 200)}}}};
     }},
    {"gradientOpacity", drawGradientOpacity},
    {"isovalues", drawIsovalues},
    {"peaks",
     [](Draw& d, const Surroundings&) -> json {
       return d.chance(0.8) ? json::object() : json{{"peaks", nameFrom(d, kPeaks)}};
     }},
};

const Field kLightFields[] = {
    {"type",
     [](Draw& d, const Surroundings&) -> json {
       return {{"type", nameFrom(d, kLightTypes)}};
     }},
    {"direction",
     [](Draw& d, const Surroundings&) -> json {
       return {{"direction", arrayOf(d.direction() * d.decades(0.1, 10))}};
     }},
    {"position",
     [](Draw& d, const Surroundings& around) -> json {
       const double far = d.chance(0.1) ? 100 : 2;
       const glm::dvec3 share = d.chance(0.3) ? d.vector(0, 1) : d.vector(-far, 1 + far);
       return {{"position", arrayOf(around.point(share))}};
     }},
    {"color",
     [](Draw& d, const Surroundings&) -> json {
       return {{"color", d.hexColor()}};
     }},
    {"intensity",
     [](Draw& d, const Surroundings&) -> json {
       return {{"intensity", d.chance(0.1) ? 0 : d.decades(0.1, 2)}};
     }},
};

/// From outside and inside, from faces, edges and corners; also along the axes through voxel centres.
json drawCamera(Draw& draw, const Surroundings& around) {
  if (draw.chance(0.05)) return json::object();
  const auto ends = [&](glm::dvec3 share, int count) {
    for (int axis = 0; axis < count; ++axis) share[axis] = draw.integer(0, 1);
    return share;
  };
  const double diagonal = around.grid.diagonal();
  const glm::dvec3 target =
      draw.chance(0.3) ? around.point(glm::dvec3(0.5)) : around.point(draw.vector(0, 1));
  const glm::dvec3 back = draw.direction();
  const double away = draw.decades(0.6, 6);
  glm::dvec3 eye = target + back * diagonal * away;
  const bool inside = draw.chance(0.2);
  if (inside) eye = around.point(ends(draw.vector(0, 1), draw.chance(0.5) ? draw.integer(1, 3) : 0));
  if (eye == target) eye += 0.5 * around.edge[0];
  json camera{{"eye", arrayOf(eye)},
              {"target", arrayOf(target)},
              {"up", draw.chance(0.05) ? arrayOf(back) : arrayOf(draw.direction())}};
  if (draw.chance(0.35))
    camera["orthoHeight"] = diagonal * draw.decades(0.1, 1.5);
  else if (inside)
    camera["fovY"] = draw.between(5, 150);
  else
    camera["fovY"] = std::min(150.0, 57 * draw.decades(0.3, 1.2) / away);
  return {{"camera", camera}};
}

/// Planes anywhere, also along the axes and through voxel centres and faces, for all, some or no channels.
json drawClip(Draw& draw, const Surroundings& around) {
  if (draw.chance(0.6)) return json::object();
  json planes = json::array();
  const int count = draw.chance(0.1) ? 8 : draw.integer(1, 3);
  for (int i = 0; i < count; ++i) {
    glm::dvec3 normal = draw.direction() * draw.decades(1e-3, 1e3);
    glm::dvec3 share = draw.vector(-0.05, 1.05);
    if (draw.chance(0.3)) {
      const int axis = draw.integer(0, 2), halves = 2 * around.grid.dims[axis];
      share[axis] = double(draw.integer(0, halves)) / halves;
      normal = glm::cross(around.edge[(axis + 1) % 3], around.edge[(axis + 2) % 3]);
      if (draw.chance(0.5)) normal = -normal;
    }
    json plane{{"point", arrayOf(around.point(share))}, {"normal", arrayOf(normal)}};
    if (draw.chance(0.5)) {
      plane["media"] = json::array();
      for (std::size_t n = 0; n < around.channels; ++n)
        if (draw.chance(0.5)) plane["media"].push_back(n);
    }
    planes.push_back(std::move(plane));
  }
  return {{"clip", planes}};
}

json drawCrop(Draw& draw, const Surroundings& around) {
  if (draw.chance(0.75)) return json::object();
  constexpr const char* kAxes[] = {"x", "y", "z"};
  json crop = json::object();
  for (int axis = 0; axis < 3; ++axis) {
    if (draw.chance(0.3)) continue;
    const double size = around.grid.dims[axis];
    const auto end = [&] {
      const double at = draw.between(-1, size + 0.5);
      return draw.chance(0.3) ? std::floor(2 * at) / 2 : at;
    };
    const double a = end(), b = draw.chance(0.1) ? a : end();
    crop[kAxes[axis]] = {std::min(a, b), std::max(a, b)};
  }
  if (draw.chance(0.5)) {
    json regions = json::array();
    for (int i = 0; i < 27; ++i) regions.push_back(draw.chance(0.6));
    crop["regions"] = regions;
  }
  return {{"crop", crop}};
}

const Field kSceneFields[] = {
    {"blend",
     [](Draw& d, const Surroundings&) -> json {
       return {{"blend", {{"mode", nameFrom(d, kBlendModes)}}}};
     }},
    {"camera", drawCamera},
    {"clip", drawClip},
    {"crop", drawCrop},
    {"shading",
     [](Draw& d, const Surroundings&) -> json {
       return {{"shading", d.chance(0.4)}};
     }},
    {"shadows",
     [](Draw& d, const Surroundings&) -> json {
       return {{"shadows", d.chance(0.35)}};
     }},
    {"integrator",
     [](Draw& d, const Surroundings&) -> json {
       const int macrocell = d.oneOf<int>({1, 1, 2, 3, 4, 5, 8, 64});
       const double length = d.decades(0.1, 4), step = length < 0.15 ? 0 : length;  // a ninth are 0
       return {{"integrator",
                {{"method", nameFrom(d, kMethods)},
                 {"macrocell", macrocell},
                 {"step", step},
                 {"sampling", nameFrom(d, kSamplings)},
                 {"seed", d.bits() >> 32}}}};
     }},
    {"image",
     [](Draw& d, const Surroundings&) -> json {
       const int width = d.integer(1, 5), height = d.integer(1, 4);
       return {{"image",
                {{"width", width},
                 {"height", height},
                 {"background", d.hexColor()},
                 {"filter", d.chance(0.8) ? "point" : "box"}}}};
     }},
    {"stop",
     [](Draw& d, const Surroundings&) -> json {
       return {{"stop", {{"error", d.decades(1e-3, 1e-1)}}}};
     }},
};

template <std::size_t N>
json drawFields(const Field (&fields)[N], const Surroundings& around, const std::string& owner) {
  json result = json::object();
  for (const Field& field : fields) {
    Draw draw(around.scene, owner + field.name);
    result.update(field.draw(draw, around));
  }
  return result;
}

json drawWire(std::uint64_t number, const VolumeSource& source) {
  Surroundings around{number, source.grid, {}, {}, source.channels.size()};
  const glm::dmat4& m = source.grid.worldFromVoxel;
  around.corner = glm::dvec3(m * glm::dvec4(glm::dvec3(-0.5), 1));
  for (int axis = 0; axis < 3; ++axis)
    around.edge[axis] = glm::dvec3(m[axis]) * double(source.grid.dims[axis]);
  json wire = drawFields(kSceneFields, around, "scene ");
  wire["channels"] = json::array();
  for (std::size_t n = 0; n < source.channels.size(); ++n) {
    around.channel = &source.channels[n];
    wire["channels"].push_back(drawFields(kChannelFields, around, "channel " + std::to_string(n) + " "));
  }
  Draw lights(number, "lights");
  const int count = lights.chance(0.2) ? 0 : lights.integer(1, 3);
  wire["lights"] = json::array();
  for (int i = 0; i < count; ++i)
    wire["lights"].push_back(drawFields(kLightFields, around, "light " + std::to_string(i) + " "));
  return wire;
}

std::vector<ChannelSource> copyOf(const std::vector<ChannelSource>& channels) {
  std::vector<ChannelSource> copies;
  for (const ChannelSource& channel : channels) {
    ChannelSource copy{
        channel.name,  channel.unit,      VoxelBuffer(channel.voxels.type(), channel.voxels.count()),
        channel.slope, channel.intercept, channel.look};
    std::copy_n(channel.voxels.data(), channel.voxels.sizeBytes(), copy.voxels.data());
    copies.push_back(std::move(copy));
  }
  return copies;
}

}  // namespace

RandomScene drawScene(std::uint64_t number) {
  RandomScene drawn{number, drawVolume(number), nullptr, {}, {}};
  drawn.volume = std::make_shared<const Volume>(drawn.source.grid, copyOf(drawn.source.channels));
  drawn.wire = drawWire(number, drawn.source);
  std::vector<io::LoadedDataset> datasets(1);
  datasets[0].id = "random";
  datasets[0].volume = drawn.volume;
  const server::SceneResolver resolver(std::make_shared<server::DatasetStore>(std::move(datasets)),
                                       {16'777'216});
  drawn.scene = resolver.replace(drawn.wire)->render;
  return drawn;
}

std::string describe(const RandomScene& drawn) {
  const Scene& s = drawn.scene;
  std::ostringstream text;
  text << "scene " << drawn.number << ": " << describe(drawn.source) << ", " << nameOf(s.blend)
       << (s.shading ? ", shading" : "") << (s.shadows ? ", shadows" : "");
  if (s.shading || s.shadows) {
    text << " (";
    for (const Light& light : s.lights) text << nameOf(light.type) << " ";
    text << s.lights.size() << " lights)";
  }
  if (!s.clip.empty()) text << ", " << s.clip.size() << " clip planes";
  if (s.crop) text << ", crop";
  const auto graded = std::count_if(s.channels.begin(), s.channels.end(),
                                    [](const ChannelAppearance& c) { return c.gradientOpacity.has_value(); });
  if (graded > 0) text << ", opacity by the gradient of " << graded;
  std::size_t surfaces = 0;
  for (const ChannelAppearance& c : s.channels) surfaces += c.isovalues.size();
  if (surfaces > 0) text << ", " << surfaces << " isovalues";
  for (const ChannelAppearance& c : s.channels)
    if (c.peaks != Peaks::off) text << ", peaks " << nameOf(c.peaks);
  for (const ChannelAppearance& c : s.channels)
    if (c.interpolation != Interpolation::trilinear) text << ", " << nameOf(c.interpolation);
  text << (s.camera.orthoHeight ? ", orthographic" : ", perspective") << ", " << s.width << "x" << s.height
       << " " << nameOf(s.filter) << ", macrocell " << s.macrocell << ", step " << s.step << ", "
       << nameOf(s.sampling) << ", thickness";
  for (const ChannelAppearance& channel : s.channels)
    text << " " << (channel.visible ? channel.density * drawn.source.grid.diagonal() : 0);
  return text.str();
}

std::string writeScene(const RandomScene& drawn, const std::string& folder) {
  std::filesystem::create_directories(folder);
  const std::string scene = folder + "/scene.json";
  std::ofstream(scene) << drawn.wire.dump(2) << "\n";
  std::string command = "scolopax reference " + scene + " -o picture.exr --data";
  for (const auto& path : writeVolume(drawn.source, folder)) command.append(" ").append(path.string());
  return command;
}

}  // namespace scolopax::random_scenes
