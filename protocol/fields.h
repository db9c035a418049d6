// SPDX-License-Identifier: Apache-2.0
// The table of the scene's fields: the single source for validation, serialisation, JSON Schema, patches and
// documentation. A new field is a line here and a member in scene.h, which has its default; what it means for
// the picture, server/scene_resolver.cpp hands to the renderer's scene.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"

namespace scolopax::protocol {

/// Constraints on a field's values beyond its C++ type. Bounds are in the field's unit.
struct Traits {
  std::string_view unit = "";
  std::optional<double> atLeast = {}, above = {};  ///< inclusive, exclusive
  std::optional<double> atMost = {}, below = {};
  std::size_t maxItems = 0;   ///< maximum length of a list
  std::size_t maxLength = 0;  ///< maximum length of a text in code points; 0 for colours and enums
  std::vector<EnumEntry> Lists::*names = nullptr;  ///< the allowed names
  bool color = false;                              ///< "#rrggbb"
};

template <class Struct, class Value>
struct Field {
  std::string_view name;  ///< the JSON key
  Value Struct::*member;
  std::string_view doc;
  Traits traits;
};

template <class Struct, class Value>
constexpr Field<Struct, Value> field(std::string_view name, Value Struct::*member, std::string_view doc,
                                     Traits traits = {}) {
  return {name, member, doc, traits};
}

/// Two fields that exclude each other: a patch that sets only one of them removes the other.
struct Exclusive {
  std::string_view first, second;
  bool bothAreAnError;
};

// Where the renderer has the same limits, server/scene_resolver.cpp checks that they are equal.
inline constexpr std::size_t kMaxChannelItems = 32;
inline constexpr std::size_t kMaxLightItems = 8;
inline constexpr std::size_t kMaxClipItems = 8;
inline constexpr std::size_t kMaxIsovalueItems = 32;
inline constexpr std::size_t kMaxControlPoints = 4096;
inline constexpr std::uint32_t kMaxSidePixels = 16384;
inline constexpr std::uint32_t kMaxMacrocellVoxels = 64;
inline constexpr std::uint32_t kMaxStopSamples = 1u << 24;

/// Specialised below: title, doc, exclusive pairs and the tuple of fields of one struct.
template <class Struct>
struct Table;

template <class T>
concept Described = requires {
  Table<T>::fields;
};

template <>
struct Table<Material> {
  static constexpr std::string_view title = "Material";
  static constexpr std::string_view doc = "How a channel reflects light (Blinn-Phong).";
  static constexpr auto fields = std::tuple{
      field("ambient", &Material::ambient, "Light that comes from everywhere; also what is left in shadow.",
            {.atLeast = 0, .atMost = 10}),
      field("diffuse", &Material::diffuse, "Matt reflection.", {.atLeast = 0, .atMost = 10}),
      field("specular", &Material::specular, "Highlight, in the light's colour.",
            {.atLeast = 0, .atMost = 10}),
      field("shininess", &Material::shininess,
            "Exponent of the highlight; a larger one makes it smaller and sharper.",
            {.above = 0, .atMost = 10000}),
  };
};

template <>
struct Table<Light> {
  static constexpr std::string_view title = "Light";
  static constexpr std::string_view doc = "One light.";
  static constexpr auto fields = std::tuple{
      field("type", &Light::type, "What kind of light.", {.names = &Lists::lightTypes}),
      field("direction", &Light::direction, "Where a directional light travels TO; need not be normalised."),
      field("position", &Light::position, "Where a point light stands; its light does not fall off.",
            {.unit = "world units"}),
      field("color", &Light::color, "Colour.", {.color = true}),
      field("intensity", &Light::intensity, "Factor of the colour.", {.atLeast = 0, .atMost = 1e6}),
  };
};

template <>
struct Table<GradientOpacity> {
  static constexpr std::string_view title = "GradientOpacity";
  static constexpr std::string_view doc =
      "A factor of the opacity that depends on the magnitude of the gradient: it emphasises boundaries and "
      "hides homogeneous regions.";
  static constexpr auto fields = std::tuple{
      field("range", &GradientOpacity::range,
            "[lo, hi]: the magnitudes at positions 0 and 1 of the curve; magnitudes outside are clamped. lo "
            "> hi reverses the curve, lo = hi is a step. null is chosen from the data that has opacity.",
            {.unit = "data units per world unit"}),
      field("points", &GradientOpacity::points,
            "Control points [position, factor] over the range, interpolated as for opacity. The factor "
            "multiplies the opacity.",
            {.maxItems = kMaxControlPoints}),
  };
};

template <>
struct Table<Isovalue> {
  static constexpr std::string_view title = "Isovalue";
  static constexpr std::string_view doc = "A surface where the scalar equals a value.";
  static constexpr auto fields = std::tuple{
      field("value", &Isovalue::value, "The value; null is the middle of the channel's range.",
            {.unit = "data units"}),
      field("opacity", &Isovalue::opacity, "Share of the light from behind that the surface absorbs.",
            {.atLeast = 0, .atMost = 1}),
      field("color", &Isovalue::color, "Colour; null is the channel's colour at the value.", {.color = true}),
  };
};

template <>
struct Table<Channel> {
  static constexpr std::string_view title = "Channel";
  static constexpr std::string_view doc = "How one channel of the data set looks.";
  static constexpr Exclusive exclusive[] = {{"color", "colormap", true}};
  static constexpr auto fields = std::tuple{
      field("name", &Channel::name, "Label; null is the name in the data set.", {.maxLength = 256}),
      field("visible", &Channel::visible, "Whether the channel is drawn."),
      field("range", &Channel::range,
            "[lo, hi]: the data values at positions 0 and 1 of the curves; values outside are clamped. lo > "
            "hi reverses the curves, lo = hi is a step. null is the window that the file states, or else "
            "chosen from the histogram.",
            {.unit = "data units"}),
      field("interpolation", &Channel::interpolation,
            "How values between voxel centres are computed from the voxels.",
            {.names = &Lists::interpolations}),
      field(
          "color", &Channel::color,
          "One colour for all values; cannot be set together with colormap. If both are null, it is what the "
          "file states, or else what the server chooses.",
          {.color = true}),
      field("colormap", &Channel::colormap,
            "Colour over the range: a name, or control points [position, color], interpolated in linear RGB.",
            {.maxItems = kMaxControlPoints, .names = &Lists::colormaps}),
      field(
          "opacity", &Channel::opacity,
          "Control points [position, value] over the range: linear between them, constant outside. Positions "
          "must not decrease; of two points at the same position, the later one applies from there on.",
          {.maxItems = kMaxControlPoints}),
      field("gradientOpacity", &Channel::gradientOpacity,
            "Opacity by the magnitude of the gradient; with null, opacity does not depend on the gradient."),
      field("isovalues", &Channel::isovalues,
            "Surfaces, drawn in every blend mode and with any opacity curve; at most 32 together with the "
            "peaks.",
            {.maxItems = kMaxIsovalueItems}),
      field("peaks", &Channel::peaks,
            "Surfaces at the maxima of the opacity curve. Each is as opaque as a layer of that opacity, one "
            "smallest voxel spacing thick.",
            {.names = &Lists::peaks}),
      field("gamma", &Channel::gamma, "The position is raised to this power before both curves are read.",
            {.above = 0, .atMost = 100}),
      field("density", &Channel::density, "Extinction where opacity is 1; null is chosen from the data.",
            {.unit = "1 / world unit", .atLeast = 0, .atMost = 1e30}),
      field("weight", &Channel::weight, "Factor of the channel's colour in blend mode mix.",
            {.atLeast = 0, .atMost = 1e6}),
      field("material", &Channel::material, "How the channel reflects light."),
  };
};

template <>
struct Table<Blend> {
  static constexpr std::string_view title = "Blend";
  static constexpr std::string_view doc = "How the channels are combined.";
  static constexpr auto fields = std::tuple{
      field("mode", &Blend::mode, "Blend mode.", {.names = &Lists::blendModes}),
  };
};

template <>
struct Table<Camera> {
  static constexpr std::string_view title = "Camera";
  static constexpr std::string_view doc =
      "Right-handed, in world space. If eye, target or up is null, it is chosen so that everything visible "
      "is in view.";
  static constexpr Exclusive exclusive[] = {{"fovY", "orthoHeight", false}};
  static constexpr auto fields = std::tuple{
      field("eye", &Camera::eye, "Where the camera stands; an orthographic camera's rays start in its plane.",
            {.unit = "world units"}),
      field("target", &Camera::target, "What it looks at.", {.unit = "world units"}),
      field("up", &Camera::up, "Direction that is up in the picture; need not be normalised."),
      field("fovY", &Camera::fovY, "Full vertical angle of view of a perspective camera.",
            {.unit = "degrees", .above = 0, .below = 180}),
      field("orthoHeight", &Camera::orthoHeight,
            "Full height of the view of an orthographic camera; null is a perspective camera.",
            {.unit = "world units", .above = 0}),
  };
};

template <>
struct Table<ClipPlane> {
  static constexpr std::string_view title = "ClipPlane";
  static constexpr std::string_view doc = "Cuts away what lies behind a plane.";
  static constexpr auto fields = std::tuple{
      field("point", &ClipPlane::point, "A point of the plane; null is the volume's centre.",
            {.unit = "world units"}),
      field("normal", &ClipPlane::normal,
            "Points to the side that is kept; must not be 0, need not be normalised."),
      field("media", &ClipPlane::media, "Indices of the channels that are clipped; null is all.",
            {.atLeast = 0, .atMost = double(kMaxChannelItems - 1), .maxItems = kMaxChannelItems}),
  };
};

template <>
struct Table<Crop> {
  static constexpr std::string_view title = "Crop";
  static constexpr std::string_view doc =
      "Two planes across every axis divide the volume into 27 regions, of which some are kept.";
  static constexpr auto fields = std::tuple{
      field("x", &Crop::x, "[a, b]: the planes across the first axis; null is the volume's faces.",
            {.unit = "voxels"}),
      field("y", &Crop::y, "[a, b]: the planes across the second axis; null is the volume's faces.",
            {.unit = "voxels"}),
      field("z", &Crop::z, "[a, b]: the planes across the third axis; null is the volume's faces.",
            {.unit = "voxels"}),
      field("regions", &Crop::regions,
            "Whether region ix + 3 iy + 9 iz is kept; 0 is below a, 1 is from a to below b, 2 is from b on."),
  };
};

template <>
struct Table<Integrator> {
  static constexpr std::string_view title = "Integrator";
  static constexpr std::string_view doc =
      "How the picture is computed. All methods show the same picture, except for noise and bias.";
  static constexpr auto fields = std::tuple{
      field("method", &Integrator::method, "Rendering method.", {.names = &Lists::methods}),
      field("macrocell", &Integrator::macrocell, "Edge of the cells that bound the extinction.",
            {.unit = "voxels", .atLeast = 1, .atMost = kMaxMacrocellVoxels}),
      field("step", &Integrator::step,
            "Step of raymarch and hybrid, at least 0.01; with 0, steps end at the faces of voxel cells. auto "
            "chooses its own steps.",
            {.unit = "smallest voxel spacing", .atLeast = 0, .atMost = 100}),
      field("sampling", &Integrator::sampling, "How the random numbers of a pixel's samples are drawn.",
            {.names = &Lists::samplings}),
      field("seed", &Integrator::seed, "Same scene, seed and sample count: the same picture, bit for bit.",
            {.atLeast = 0, .atMost = 4294967295.0}),
  };
};

template <>
struct Table<ImageSettings> {
  static constexpr std::string_view title = "ImageSettings";
  static constexpr std::string_view doc = "The picture.";
  static constexpr auto fields = std::tuple{
      field("width", &ImageSettings::width, "Width.",
            {.unit = "pixels", .atLeast = 1, .atMost = kMaxSidePixels}),
      field("height", &ImageSettings::height, "Height.",
            {.unit = "pixels", .atLeast = 1, .atMost = kMaxSidePixels}),
      field("background", &ImageSettings::background, "What 8-bit pictures are composited over.",
            {.color = true}),
      field("filter", &ImageSettings::filter, "Where the samples of a pixel lie.",
            {.names = &Lists::filters}),
  };
};

template <>
struct Table<Stop> {
  static constexpr std::string_view title = "Stop";
  static constexpr std::string_view doc =
      "When rendering ends: at the first of these limits that is reached. If none is set, after 64 samples "
      "in a render and 4096 in a session.";
  static constexpr auto fields = std::tuple{
      field("samples", &Stop::samples, "Samples per pixel.", {.atLeast = 1, .atMost = kMaxStopSamples}),
      field("seconds", &Stop::seconds, "Time spent rendering.", {.unit = "seconds", .above = 0}),
      field("error", &Stop::error, "Estimated RMSE over linear premultiplied RGBA, from 16 samples on.",
            {.above = 0}),
  };
};

template <>
struct Table<Scene> {
  static constexpr std::string_view title = "Scene";
  static constexpr std::string_view doc = "All that a client can edit; {} is a valid scene.";
  static constexpr auto fields = std::tuple{
      field("dataset", &Scene::dataset, "Id of the data set; null is the first.", {.maxLength = 256}),
      field(
          "time", &Scene::time,
          "Step of a time series, from 0; nothing is interpolated. A data set of one step is the same at all "
          "times.",
          {.atLeast = 0, .atMost = 4294967295.0}),
      field("channels", &Scene::channels,
            "Entry i is the i-th channel of the data set; missing entries have the defaults.",
            {.maxItems = kMaxChannelItems}),
      field("blend", &Scene::blend, "How the channels are combined."),
      field("camera", &Scene::camera, "Where the eye is and where it looks."),
      field("clip", &Scene::clip, "Planes that cut away what lies behind them.", {.maxItems = kMaxClipItems}),
      field("crop", &Scene::crop, "Boxes that are cut away."),
      field("lights", &Scene::lights, "Lights for shading and shadows; none means one headlight, at the eye.",
            {.maxItems = kMaxLightItems}),
      field("shading", &Scene::shading,
            "Lighting with the gradient of the scalar field as the surface normal; fades where the field is "
            "flat."),
      field("shadows", &Scene::shadows, "Whether channels cast shadows, on themselves and each other."),
      field("integrator", &Scene::integrator, "How the picture is computed."),
      field("image", &Scene::image, "The picture."),
      field("stop", &Scene::stop, "When rendering ends."),
  };
};

/// Calls f(field) for every field of the struct, in the table's order.
template <Described Struct, class F>
constexpr void forEachField(F&& f) {
  std::apply([&](const auto&... fields) { (f(fields), ...); }, Table<Struct>::fields);
}

/// Calls f(exclusive) for every pair of fields that exclude each other.
template <Described Struct, class F>
constexpr void forEachExclusive(F&& f) {
  if constexpr (requires { Table<Struct>::exclusive; }) {
    for (const Exclusive& pair : Table<Struct>::exclusive) f(pair);
  }
}

}  // namespace scolopax::protocol
