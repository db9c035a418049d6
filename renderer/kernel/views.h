// SPDX-License-Identifier: Apache-2.0
// A scene as kernels see it: plain views of memory that a render plan (data/render_plan, which fills them) or
// a device owns. Only visible channels are included.
#pragma once
#include <atomic>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "renderer/core/scalar_type.h"
#include "renderer/kernel/camera_rays.h"
#include "renderer/kernel/majorants.h"

namespace scolopax::kernel {

inline constexpr int kCurveBuckets = 256;

/// Piecewise-linear curve over [0,1], constant before its first knot and after its last.
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
  float inverseWidth;  ///< 1 / distance to the next knot, or 0
  float stored;        ///< stored value at this knot, less the channel's origin; negated where
                       ///< positions fall as stored values rise
  float opacity;
  glm::vec3 color;  ///< linear RGB
};
inline constexpr int kKnotFloats = sizeof(OpticalKnot) / sizeof(float);

/// The opacity and colour curves of a channel, merged: both are given at the knots of either. The first knot
/// is at 0 and the last at 1.
struct OpticalCurveView {
  const OpticalKnot* knots;
  const std::uint16_t* buckets;  ///< as in CurveView
  int count;
  bool jumps;         ///< some knots share a position
  float first, last;  ///< the opacity is 0 at positions up to `first` and from `last` on
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

/// The part of the volume that clip planes and crop keep, in voxel coordinates. Everything outside the box
/// and behind the planes that clip all channels is cut away; inside, parts may be cut away, from some
/// channels or all.
struct ClipView {
  glm::vec3 low, high;
  int wholePlanes;  ///< number of leading planes that clip all channels
  int planeCount;
  ClipPlaneView planes[kMaxClipPlanes];
  bool parts;           ///< some planes clip only some channels, or the kept crop regions are not a box
  glm::vec3 cropAt[2];  ///< positions of the crop planes; infinite where they cut nothing off
  std::uint32_t regions[kCropRegions];  ///< (x, y, z) is at x + 3 y + 9 z: all bits set if kept, else 0
};

enum class LightKind : std::uint8_t { directional, point, headlight };

struct LightView {
  LightKind kind;
  glm::vec3 vector;     ///< directional: towards the light in voxel space, of length 1 in world units; point:
                        ///< the light's position in voxel coordinates
  glm::vec3 intensity;  ///< linear colour times intensity
};
inline constexpr int kMaxLights = 8;
inline constexpr int kMaxVisibleChannels = 32;

/// Factor of the opacity that depends on |gradient|, in stored values per smallest spacing.
struct GradientFactorView {
  float origin, scale, offset;  ///< position = clamp((|gradient| - origin) * scale + offset, 0, 1)
  CurveView<float> curve;       ///< no knots: opacity does not depend on the gradient
  OpticalCurveView optical;     ///< the same curve, for quadrature
  glm::mat3 fromVoxel;          ///< as SceneView::gradientFromVoxel
};

/// A surface of a channel.
struct SurfaceView {
  float
      value;  ///< stored value less the channel's origin, negated where data values fall as stored ones rise
  float opacity;    ///< in (0,1]
  glm::vec3 color;  ///< linear RGB
};
inline constexpr int kMaxSurfaces = 32;  ///< of a channel

/// How the scalar between voxels follows from them: filters.h.
enum class Filter : std::uint8_t { trilinear, cubic, nearest };

/// Where the values of a channel are.
struct FieldView {
  const void* voxels;  ///< voxels of this channel, interleaved with others of its type
  ScalarType type;
  Filter filter;
  std::uint8_t fetches;  ///< trilinear samples that one sample costs as much as
  bool finite;           ///< whether all voxels are finite
  int lane, stride;      ///< index among the interleaved channels, and their number

  SCOLOPAX_HD bool has(Filter which) const {
    return kPlainDevice ? which == Filter::trilinear : filter == which;
  }
  SCOLOPAX_HD unsigned cost() const { return kPlainDevice ? 1 : fetches; }
};

/// One channel: its values, and how a stored value becomes extinction and colour.
struct ChannelView {
  FieldView field;
  float origin, scale, offset;  ///< position = clamp((stored - origin) * scale + offset, 0, 1)
  float gamma;                  ///< both curves are evaluated at position^gamma
  float density;                ///< extinction = opacity * density, per world unit
  CurveView<float> opacity;
  CurveView<glm::vec3> color;  ///< linear RGB
  OpticalCurveView optical;    ///< both curves, for quadrature
  float weight;                ///< weight of the colour in blend mode mix
  MaterialView material;
  float inverseRange;  ///< 1 / |hi - lo| of the channel's range, in stored values
  GradientFactorView factor;
  const SurfaceView* surfaces;
  int surfaceCount;
  bool dataFalls;  ///< data values fall as stored values rise
};

/// Matter behind this much is not marched.
struct OpacityLimit {
  float transmittance, depth;  ///< the same limit twice: depth = -log(transmittance)
};

struct SceneView {
  CameraRays rays;
  int width, height;
  std::uint32_t seed;
  float filterWidth;  ///< samples are spread over a square of this side, in pixels; 0: at the pixel's centre
  glm::ivec3 dims;
  bool nearest;  ///< some channel takes the value of the nearest voxel, which changes between voxel centres
  ClipView clip;
  int channelCount;
  const ChannelView* channels;
  MajorantView majorants;
  bool surfaces;              ///< some channel has surfaces
  MajorantView surfaceCells;  ///< the macrocells that may have one; only if there are surfaces
  float step;                 ///< step of quadrature, world units
  bool voxelwise;       ///< quadrature also cuts rays at the faces of voxel cells, between which scalars are
                        ///< cubics
  float thickest;       ///< optical depth above which voxelwise segments are shortened
  OpacityLimit opaque;  ///< where marched rays end
  float stratum;        ///< share of a ray's light per lighting computation of quadrature (strata.h)
  bool shading, shadows;  ///< the scene's
  int lightCount;         ///< 0 unless one of them is on
  LightView lights[kMaxLights];
  glm::mat3 worldFromVoxel;  ///< linear part, in units of the smallest spacing, so that lengths are near 1 at
                             ///< any scale
  glm::mat3 gradientFromVoxel;      ///< its inverse transpose
  float smallestSpacing;            ///< world units
  const std::atomic<bool>* cancel;  ///< null on devices: whether rays should end early, without a result

  /// Channels whose opacity may depend on the gradient: length of arrays, which must not be empty.
  static constexpr int kFactors = kPlainDevice ? 1 : kMaxVisibleChannels;
  SCOLOPAX_HD bool hasFactor(int n) const { return !kPlainDevice && channels[n].factor.curve.count != 0; }
  SCOLOPAX_HD bool hasSurfaces() const { return !kPlainDevice && surfaces; }
  SCOLOPAX_HD bool hasNearest() const { return !kPlainDevice && nearest; }
  /// Whether quadrature cuts rays at the faces of voxel cells. It must for nearest voxels, where fields jump.
  SCOLOPAX_HD bool cutsAtVoxels() const { return voxelwise || nearest; }
#if defined(__CUDA_ARCH__)
  SCOLOPAX_HD static constexpr bool isCancelled() { return false; }
#else
  /// A single ray may take seconds, so loops along rays ask.
  SCOLOPAX_HD bool isCancelled() const { return cancel && cancel->load(std::memory_order_relaxed); }
#endif
};

/// A plain scene: trilinear interpolation, no surfaces, no opacity that depends on the gradient, and no
/// record of first collisions. A type of its own, because device kernels of plain scenes are compiled apart
/// (kPlainDevice).
struct PlainSceneView : SceneView {};

/// Cost of one sample per lane, for tests, benchmarks and the cost heat map.
template <class L>
struct CostOf {
  using Word = typename L::Word;
  Word fetches{0u}, cellSteps{0u}, randomBlocks{0u}, truncated{0u};
};
using SampleCost = CostOf<One>;

/// First collision of every lane's ray, for pictures of depth and channels.
template <class L>
struct FirstCollisionOf {
  /// World units; integrators give it along the ray, passes along the view direction.
  typename L::Float depth{0.0f};
  typename L::Int channel{-1};  ///< index among the visible channels; -1: no collision
};
using FirstCollision = FirstCollisionOf<One>;

}  // namespace scolopax::kernel
