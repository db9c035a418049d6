// SPDX-License-Identifier: Apache-2.0
// Surfaces of a channel as kernels read them. data/surfaces fills them; surfaces.h finds them along rays.
#pragma once
#include <glm/vec3.hpp>

namespace scolopax::kernel {

/// A surface of a channel.
struct SurfaceView {
  /// Stored value less the channel's origin, negated where data values fall as stored values rise.
  float value;
  float opacity;    ///< in (0,1]
  glm::vec3 color;  ///< linear RGB
};
inline constexpr int kMaxSurfaces = 32;  ///< of a channel

}  // namespace scolopax::kernel
