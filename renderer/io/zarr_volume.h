// SPDX-License-Identifier: Apache-2.0
// Volumes of a Zarr hierarchy: arrays, with OME metadata or without, and which of their axes is which.
#pragma once
#include <string>
#include <vector>

#include "renderer/io/ngff.h"
#include "renderer/io/volume_file.h"
#include "renderer/io/zarr_chunks.h"

namespace scolopax::io {

struct ZarrLevel {
  ZarrArray array;
  ZarrAxes axes;
};

struct ZarrVolume {
  VolumeInfo info;
  std::vector<ZarrLevel> levels;  ///< as many as `info` has
};

/// An image with OME metadata. Throws Error: badInput if arrays are missing or do not have the axes that the
/// metadata tell; unsupported for axes that cannot be shown. Levels of another type than the finest are left
/// out with a warning.
ZarrVolume ngffVolume(const ZarrStore& store, const NgffImage& image, const std::string& path,
                      const OpenOptions& options);

/// An array without OME metadata as an image: axes by their names if all are known, else z, y, x are the last
/// ones, before them channels, before them times; of four axes, the first is what the options say.
NgffImage plainZarrImage(const ZarrNode& node, const OpenOptions& options);

}  // namespace scolopax::io
