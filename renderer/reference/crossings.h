// SPDX-License-Identifier: Apache-2.0
// Where a ray crosses the surfaces of channels.
#pragma once
#include <span>
#include <vector>

#include "renderer/reference/stretch.h"

namespace scolopax::reference {

struct Crossing {
  double t;  ///< as the ray's cuts
  const ActiveChannel* channel;
  const Surface* surface;
};

/// All crossings, front to back; of coincident ones, the first channel's first. A ray crosses a surface where
/// its scalar passes from below the value to at least the value, or back; with nearest, this is at faces of
/// voxels. There is no crossing where the volume or the kept part begins or ends, nor at voxels that are not
/// finite. `ray` must already be cut at the planes of `clipping`, and for nearest at the faces of voxels.
std::vector<Crossing> crossingsOf(const RayCells& ray, const glm::ivec3& dims, const Clipping& clipping,
                                  std::span<const ActiveChannel> channels);

}  // namespace scolopax::reference
