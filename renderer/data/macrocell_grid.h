// SPDX-License-Identifier: Apache-2.0
// Per macrocell and channel: the interval of stored values that any sample inside can take. Made from a
// Volume once; majorant_grid reads it at every edit.
#pragma once
#include <memory>
#include <vector>

#include "renderer/data/volume.h"

namespace scolopax {

/// Stored values; lo > hi where no sample of the cell is finite.
struct ValueInterval {
  float lo, hi;
};

struct MacrocellGrid {
  int size = 0;         ///< voxels per edge
  glm::ivec3 cells{0};  ///< per axis; cell (i,j,k) covers voxel coordinates [i, i+1] * size
  std::vector<std::vector<ValueInterval>> channels;  ///< per channel of the volume: cells, x fastest
};

/// Measures all channels. The interval covers the voxels whose interpolation reaches into the cell, and what
/// rounding in kernel/sample_volume.h can add.
MacrocellGrid buildMacrocells(const Volume& volume, int size);

/// The same, shared among everybody who asks for this volume and size while somebody holds it.
std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size);

}  // namespace scolopax
