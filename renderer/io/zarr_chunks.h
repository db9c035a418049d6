// SPDX-License-Identifier: Apache-2.0
// Reads the chunks of a Zarr array that one time and some channels need.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "renderer/io/channel_writer.h"
#include "renderer/io/loading.h"
#include "renderer/io/zarr_array.h"
#include "renderer/io/zarr_store.h"

namespace scolopax::io {

/// Which axis of an array is which; other axes have one voxel.
struct ZarrAxes {
  std::array<std::optional<std::size_t>, 3> space = {};  ///< x, y, z
  std::optional<std::size_t> channel = {}, time = {};
};

/// Writes channels[i] at `time` with writers[i]; missing chunks have the fill value. Throws Error(badInput)
/// for damaged chunks, unsupported for more than 2^18 chunks, tooLarge if the memory limit does not allow a
/// chunk, and as the store and the writers.
void readZarrChunks(const ZarrStore& store, const ZarrArray& array, const ZarrAxes& axes, std::size_t time,
                    const std::vector<std::size_t>& channels, std::vector<ChannelWriter>& writers,
                    Loading& loading);

}  // namespace scolopax::io
