// SPDX-License-Identifier: Apache-2.0
// The scene in its wire form: everything that a client can edit. It is read from JSON (scene_json.h) as
// fields.h describes, and the server resolves it into the renderer's scene. An empty optional means
// "automatic" or "none".
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace scolopax::protocol {

/// On the wire `[position, value]`, both in [0,1].
struct ControlPoint {
  double position = 0;
  double value = 0;
  bool operator==(const ControlPoint&) const = default;
};

/// On the wire `[position, "#rrggbb"]`, position in [0,1].
struct ColorPoint {
  double position = 0;
  std::string color;
  bool operator==(const ColorPoint&) const = default;
};

/// The name of a colour table, or control points.
using Colormap = std::variant<std::string, std::vector<ColorPoint>>;

/// Blinn-Phong coefficients.
struct Material {
  double ambient = 0.3;
  double diffuse = 0.7;
  double specular = 0.2;
  double shininess = 20;
  bool operator==(const Material&) const = default;
};

/// Opacity by the magnitude of the gradient.
struct GradientOpacity {
  std::optional<std::array<double, 2>> range;
  std::vector<ControlPoint> points{{0, 0}, {1, 1}};
  bool operator==(const GradientOpacity&) const = default;
};

/// A surface where the scalar equals a value.
struct Isovalue {
  std::optional<double> value;
  double opacity = 1;
  std::optional<std::string> color;  ///< "#rrggbb"; none: the channel's colour at the value
  bool operator==(const Isovalue&) const = default;
};

struct Channel {
  std::optional<std::string> name;
  bool visible = true;
  std::optional<std::array<double, 2>> range;
  std::string interpolation = "trilinear";
  std::optional<std::string> color;  ///< "#rrggbb"; never together with colormap
  std::optional<Colormap> colormap;
  std::vector<ControlPoint> opacity{{0, 0}, {1, 1}};
  std::optional<GradientOpacity> gradientOpacity;  ///< none: opacity does not depend on the gradient
  std::vector<Isovalue> isovalues;
  std::string peaks = "off";
  double gamma = 1;
  std::optional<double> density;
  double weight = 1;
  Material material;
  bool operator==(const Channel&) const = default;
};

struct Blend {
  std::string mode = "density";
  bool operator==(const Blend&) const = default;
};

struct Light {
  std::string type = "directional";
  std::array<double, 3> direction{0.5, -0.5, -1};
  std::array<double, 3> position{0, 0, 0};
  std::string color = "#ffffff";
  double intensity = 1;
  bool operator==(const Light&) const = default;
};

struct Camera {
  std::optional<std::array<double, 3>> eye, target, up;
  double fovY = 35;
  std::optional<double> orthoHeight;  ///< when set, fovY is not used
  bool operator==(const Camera&) const = default;
};

/// Keeps the points x with dot(normal, x - point) >= 0.
struct ClipPlane {
  std::optional<std::array<double, 3>> point;
  std::array<double, 3> normal{0, 0, 1};
  std::optional<std::vector<std::uint32_t>> media;
  bool operator==(const ClipPlane&) const = default;
};

struct Crop {
  std::optional<std::array<double, 2>> x, y, z;
  std::array<bool, 27> regions{false, false, false, false, false, false, false, false, false,
                               false, false, false, false, true,  false, false, false, false,
                               false, false, false, false, false, false, false, false, false};
  bool operator==(const Crop&) const = default;
};

struct Integrator {
  std::string method = "auto";
  std::uint32_t macrocell = 4;
  double step = 0.5;
  std::string sampling = "low-discrepancy";
  std::uint32_t seed = 0;
  bool operator==(const Integrator&) const = default;
};

struct ImageSettings {
  std::uint32_t width = 512;
  std::uint32_t height = 512;
  std::string background = "#000000";
  std::string filter = "box";
  bool operator==(const ImageSettings&) const = default;
};

struct Stop {
  std::optional<std::uint32_t> samples;
  std::optional<double> seconds;
  std::optional<double> error;
  bool operator==(const Stop&) const = default;
};

struct Scene {
  std::optional<std::string> dataset;
  std::uint32_t time = 0;
  std::vector<Channel> channels;
  Blend blend;
  Camera camera;
  std::vector<ClipPlane> clip;
  Crop crop;
  std::vector<Light> lights;
  bool shading = false;
  bool shadows = false;
  Integrator integrator;
  ImageSettings image;
  Stop stop;
  bool operator==(const Scene&) const = default;
};

}  // namespace scolopax::protocol
