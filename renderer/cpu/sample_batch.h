// SPDX-License-Identifier: Apache-2.0
// Sampling several points of a ray at once, in the instruction set that the processor has. Every version
// gives the bits of kernel/sample_volume.h, which all are tested against.
#pragma once
#include "renderer/cpu/instruction_set.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Voxels must have kVoxelPadding readable bytes after the last (VoxelBuffer has).
kernel::SampleBatch sampleBatchFor(InstructionSet set);

}  // namespace scolopax
