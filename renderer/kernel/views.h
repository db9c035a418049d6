// SPDX-License-Identifier: Apache-2.0
// What a kernel sees of a scene: plain views over memory that a launcher owns (data/render_plan fills them).
// Only channels that can be seen are in here.
#pragma once
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "renderer/core/scalar_type.h"
#include "renderer/kernel/camera_rays.h"
#include "renderer/kernel/majorants.h"

namespace scolopax::kernel {

inline constexpr int kCurveBuckets = 256;

/// Piecewise-linear curve over [0,1], constant outside the first and last of its knots.
template <class Value>
struct CurveView {
  const float* positions;  ///< not decreasing
  const Value* values;
  const std::uint16_t* buckets;  ///< kCurveBuckets + 1: last knot at or before the bucket's start, or 0
  int count;
};

/// Opacity and colour at a knot of either curve.
struct OpticalKnot {
  float position;
  float inverseWidth;  ///< 1 / way to the next knot, or 0
  float opacity;
  glm::vec3 color;  ///< linear RGB
};
inline constexpr int kKnotFloats = sizeof(OpticalKnot) / sizeof(float);

/// Both curves of a channel on the knots of both; the first knot is at 0 and the last at 1.
struct OpticalCurveView {
  const OpticalKnot* knots;
  const std::uint16_t* buckets;  ///< as in CurveView
  int count;
  float first, last;  ///< no opacity at positions up to `first` and from `last` on
};

/// Blinn-Phong coefficients of one channel.
struct MaterialView {
  float ambient, diffuse, specular, shininess;
};

/// Points with dot(normal, point) + offset >= 0, in voxel coordinates, are kept.
struct ClipPlaneView {
  glm::vec3 normal;
  float offset;
  std::uint32_t channels;  ///< bit n: visible channel n is clipped
};
inline constexpr int kMaxClipPlanes = 8;
inline constexpr int kCropRegions = 27;

/// What clip planes and crop leave of the volume, in voxel coordinates. Nothing lies outside of the box and
/// of the planes that clip all channels; inside, parts may be cut out of some.
struct ClipView {
  glm::vec3 low, high;
  int wholePlanes;  ///< the first of the planes: they clip all channels
  int planeCount;
  ClipPlaneView planes[kMaxClipPlanes];
  bool parts;                           ///< planes of some channels, or regions of crop that are not a box
  glm::vec3 cropAt[2];                  ///< crop planes; infinite where they cut nothing off
  std::uint32_t regions[kCropRegions];  ///< at x + 3 y + 9 z: all bits where the region is kept, or none
};

enum class LightKind : std::uint8_t { directional, point, headlight };

struct LightView {
  LightKind kind;
  glm::vec3 vector;     ///< directional: towards the light, voxel space, length 1 in world units; point: its
                        ///< voxel position
  glm::vec3 intensity;  ///< linear colour times intensity
};
inline constexpr int kMaxLights = 8;
inline constexpr int kMaxVisibleChannels = 32;

/// Factor of the opacity by |gradient| of stored values per smallest spacing.
struct GradientFactorView {
  float origin, scale, offset;  ///< position = clamp((|gradient| - origin) * scale + offset, 0, 1)
  CurveView<float> curve;       ///< no knots: opacity does not depend on the gradient
  OpticalCurveView optical;     ///< the same, for quadrature
  glm::mat3 fromVoxel;          ///< as SceneView::gradientFromVoxel
};

/// One channel: where its voxels are and how a stored value becomes extinction and colour.
struct ChannelView {
  const void* voxels;  ///< of this channel and others of its type, interleaved
  ScalarType type;
  int lane, stride;             ///< which of how many
  float origin, scale, offset;  ///< position = clamp((stored - origin) * scale + offset, 0, 1)
  float gamma;                  ///< position^gamma goes into both curves
  float density;                ///< extinction = opacity * density, per world unit
  CurveView<float> opacity;
  CurveView<glm::vec3> color;  ///< linear RGB
  OpticalCurveView optical;    ///< both, for quadrature
  float weight;                ///< of the colour in blend mode mix
  MaterialView material;
  float inverseRange;  ///< 1 / |hi - lo| of the range in stored values
  bool finite;         ///< all voxels are
  GradientFactorView factor;
};

struct SceneView {
  CameraRays rays;
  int width, height;
  std::uint32_t seed;
  bool filterBox;  ///< false: every sample at the pixel's centre
  glm::ivec3 dims;
  ClipView clip;
  int channelCount;
  const ChannelView* channels;
  MajorantView majorants;
  float step;      ///< of quadrature, world units
  float stratum;   ///< share of a ray's light for which quadrature works out lighting once
  int lightCount;  ///< 0 unless shading or shadows are on
  LightView lights[kMaxLights];
  glm::mat3 worldFromVoxel;  ///< linear part, in units of the smallest spacing: lengths near 1 at any scale
  glm::mat3 gradientFromVoxel;  ///< its inverse transpose
  float smallestSpacing;        ///< world units

  static constexpr int kFactors = kMaxVisibleChannels;  ///< channels that may have one: length of arrays
  /// Whether the opacity of channel n depends on the gradient.
  SCOLOPAX_HD bool hasFactor(int n) const { return channels[n].factor.curve.count != 0; }
};

/// A scene of curves alone: kernels of this view are compiled without what other scenes need. Only devices
/// have such kernels, whose registers and local memory are taken for all that is compiled.
struct PlainSceneView : SceneView {
  static constexpr int kFactors = 1;  // none, but arrays must not be empty
  SCOLOPAX_HD static constexpr bool hasFactor(int) { return false; }
};

/// What the samples of all lanes cost, for tests, benchmarks and the cost heat map.
template <class L>
struct CostOf {
  using Word = typename L::Word;
  Word fetches{0u}, cellSteps{0u}, randomBlocks{0u}, truncated{0u};
};
using SampleCost = CostOf<One>;

/// What every lane's ray meets first, for pictures of depth and channels.
template <class L>
struct FirstCollisionOf {
  typename L::Float depth{0.0f};  ///< world units; integrators give it along the ray, passes along the view
  typename L::Int channel{-1};    ///< among the visible channels; -1: nothing was met
};
using FirstCollision = FirstCollisionOf<One>;

}  // namespace scolopax::kernel
