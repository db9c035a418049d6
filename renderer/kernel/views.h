// SPDX-License-Identifier: Apache-2.0
// A scene as kernels see it: plain views of memory that a render plan (data/render_plan, which fills them) or
// a device owns. Only visible channels are included. What belongs to one part of the kernels is in a header
// of its own under views/.
#pragma once
#include <atomic>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "renderer/kernel/camera_rays.h"
#include "renderer/kernel/host_flag.h"
#include "renderer/kernel/majorants.h"
#include "renderer/kernel/views/clip_view.h"
#include "renderer/kernel/views/curve_view.h"
#include "renderer/kernel/views/field_view.h"
#include "renderer/kernel/views/gradient_factor_view.h"
#include "renderer/kernel/views/light_view.h"
#include "renderer/kernel/views/surface_view.h"

namespace scolopax::kernel {

inline constexpr int kMaxVisibleChannels = 32;

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

/// How much matter a ray is marched through: what lies behind it is left out.
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
  const std::atomic<bool>* cancel;  ///< whether rays should end early, without a result; null: never

  /// Channels whose opacity may depend on the gradient: length of arrays, which must not be empty.
  static constexpr int kFactors = kPlainDevice ? 1 : kMaxVisibleChannels;
  SCOLOPAX_HD bool hasFactor(int n) const { return !kPlainDevice && channels[n].factor.curve.count != 0; }
  SCOLOPAX_HD bool hasSurfaces() const { return !kPlainDevice && surfaces; }
  SCOLOPAX_HD bool hasNearest() const { return !kPlainDevice && nearest; }
  /// Whether quadrature cuts rays at the faces of voxel cells. It must for nearest voxels, where fields jump.
  SCOLOPAX_HD bool cutsAtVoxels() const { return voxelwise || nearest; }
  /// A single ray may take seconds, so loops along rays ask. On a device, the answer may be late, and "no"
  /// after a "yes": results are valid only if `cancel` is not set when the kernel has completed.
  SCOLOPAX_HD bool isCancelled() const {
#if defined(__CUDA_ARCH__)
    return cancel && isSetOnHost(cancel);
#else
    return cancel && cancel->load(std::memory_order_relaxed);
#endif
  }
};

/// A plain scene: trilinear interpolation, no surfaces, no opacity that depends on the gradient, and no
/// record of first collisions. A type of its own, because device kernels of plain scenes are compiled apart
/// (kPlainDevice).
struct PlainSceneView : SceneView {};

}  // namespace scolopax::kernel
