// SPDX-License-Identifier: Apache-2.0
// What to render, with every value resolved. Made by the server from the wire's scene and data/defaults; read
// by the render plan and by the reference.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "renderer/data/camera.h"
#include "renderer/data/clipping.h"
#include "renderer/data/light.h"
#include "renderer/data/method.h"

namespace scolopax {

struct OpacityKnot {
  double position;  ///< in [0,1] over the channel's range
  double value;     ///< in [0,1]
  bool operator==(const OpacityKnot&) const = default;
};
struct ColorKnot {
  double position;
  glm::dvec3 color;  ///< linear RGB
  bool operator==(const ColorKnot&) const = default;
};

/// Opacity by the magnitude of the gradient: |gradient| (data units per world unit) -> clamp((|gradient| -
/// lo) / (hi - lo), 0, 1) -> a factor of the opacity, linear between knots and constant outside the first and
/// last. Equal positions and equal range ends are treated as in ChannelAppearance. The gradient is that of
/// shading; where one of its differences is not finite, the factor is 0.
struct GradientOpacity {
  double rangeLo = 0, rangeHi = 1;                  ///< data units per world unit
  std::vector<OpacityKnot> factor{{0, 0}, {1, 1}};  ///< values in [0,1]
  bool operator==(const GradientOpacity&) const = default;
};

/// A surface where the scalar equals a value: between where it is at least that value and where it is below.
/// A ray that crosses it loses the share `opacity` of its light to it.
struct Isovalue {
  double value;                     ///< data units
  double opacity = 1;               ///< in [0,1], whatever the density
  std::optional<glm::dvec3> color;  ///< linear RGB; none: that of the channel at the value
  bool operator==(const Isovalue&) const = default;
};

/// How one channel looks. Scalar s (data units) -> clamp((s - lo) / (hi - lo), 0, 1)^gamma -> both curves,
/// linear between knots and constant outside the first and last. Positions do not decrease; of two equal
/// ones, the later knot applies from there on. lo > hi reverses the range; lo == hi is a step: 0 below lo, 1
/// at lo and above.
struct ChannelAppearance {
  bool visible = true;
  double rangeLo = 0, rangeHi = 1;  ///< data units
  double gamma = 1;                 ///< > 0
  double density = 1;               ///< extinction = opacity * density, per world unit; >= 0
  double weight = 1;                ///< of the colour in blend mode mix; >= 0
  Material material{};
  std::vector<OpacityKnot> opacity{{0, 0}, {1, 1}};
  std::vector<ColorKnot> color{{0, {1, 1, 1}}};
  std::optional<GradientOpacity> gradientOpacity{};
  std::vector<Isovalue> isovalues{};
  /// Whether every interior maximum of the opacity curve is a surface, with the opacity that matter of the
  /// curve's extinction has if it is as thick as the smallest spacing. A plateau has one, in its middle.
  Peaks peaks = Peaks::off;
  /// How the scalar follows from the voxels. Points are first moved to the nearest point between the
  /// outermost voxel centres. Trilinear: where one of the eight voxels of a cell is not finite, there is no
  /// value. Cubic: the uniform cubic B-spline whose coefficients are the voxels, which are repeated beyond
  /// the border; no value where one of the 64 is not finite; its gradient is the spline's own. Nearest: of
  /// two voxels at the same distance along an axis, the later; the gradient is that of trilinear
  /// interpolation.
  Interpolation interpolation = Interpolation::trilinear;
  bool operator==(const ChannelAppearance&) const = default;
};

struct Scene {
  std::vector<ChannelAppearance> channels;  ///< one per channel of the volume
  Camera camera;
  BlendMode blend = BlendMode::density;
  bool shading = false;  ///< by the gradient of the scalar field
  bool shadows = false;
  std::vector<ClipPlane> clip;  ///< at most kernel::kMaxClipPlanes
  std::optional<Crop> crop;
  std::vector<Light> lights;  ///< at most kernel::kMaxLights; none means one headlight
  Method method = Method::superposed;
  int macrocell = 4;  ///< voxels per macrocell edge, 1 to 64
  /// Of raymarch and hybrid, in smallest spacings, 0.01 to 100; 0: from one face of voxel cells to the next
  double step = 0.5;
  Sampling sampling = Sampling::lowDiscrepancy;
  std::uint32_t seed = 0;
  int width = 512, height = 512;
  glm::vec3 background{0};  ///< linear RGB
  PixelFilter filter = PixelFilter::box;
  bool operator==(const Scene&) const = default;
};

/// Whether both scenes make the same film. They may differ only in the background, which is added to the
/// finished image.
bool makeSameFilm(const Scene& a, const Scene& b);

inline constexpr int kMaxImageSide = 16384;
inline constexpr double kLeastStep = 0.01;  ///< other than 0

}  // namespace scolopax
