// SPDX-License-Identifier: Apache-2.0
// The voxels of a channel as kernels read them.
#pragma once
#include "renderer/data/method.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views/field_view.h"

namespace scolopax {

/// Valid while the voxels live.
kernel::FieldView fieldView(const Channel& channel, Interpolation interpolation = Interpolation::trilinear);

/// Stored value at a point in voxel coordinates, as kernels sample it. Not finite where there is none. `dims`
/// are those of the volume.
float sampleStored(const Channel& channel, const glm::ivec3& dims, const glm::dvec3& point,
                   Interpolation interpolation);

}  // namespace scolopax
