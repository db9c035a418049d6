// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

namespace scolopax {

/// What an edit of the scene made stale and had to be rebuilt.
struct RebuildStats {
  int macrocellChannels = 0;      ///< channels whose macrocells were measured again
  int majorantChannels = 0;       ///< channels whose table of bounds was rebuilt
  std::size_t majorantCells = 0;  ///< macrocells whose majorant was recomputed
  bool filmReset = false;         ///< false: the new scene gives the same picture, so the samples are kept
  double rebuildMs = 0;           ///< including the trial plan on which method and step are chosen
};

}  // namespace scolopax
