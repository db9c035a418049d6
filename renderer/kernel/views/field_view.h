// SPDX-License-Identifier: Apache-2.0
// The voxels of a channel as kernels read them. data/field_view fills it; sample_volume.h and filters.h
// sample it.
#pragma once
#include <cstdint>

#include "renderer/core/scalar_type.h"
#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

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

}  // namespace scolopax::kernel
