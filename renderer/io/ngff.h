// SPDX-License-Identifier: Apache-2.0
// OME metadata of Zarr groups (NGFF 0.1 to 0.5, https://ngff.openmicroscopy.org): axes, levels with their
// scales, and how channels are to be shown. From a group's attributes to volumes.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/loading.h"
#include "renderer/io/zarr_array.h"

namespace scolopax::io {

struct NgffAxis {
  std::string name;
  std::string type;  ///< "space", "time", "channel"; "" if unknown
  std::string unit;  ///< as written: "micrometer"; "" if unknown
};

/// World coordinate along each axis = scale * index + translation.
struct NgffTransform {
  std::vector<double> scale, translation;  ///< one for each axis; both empty if none is stated
  bool translated = false;                 ///< whether a translation of this level alone is stated
};

struct NgffLevel {
  std::string path;  ///< in the store
  NgffTransform transform;
};

struct NgffChannel {
  std::string name;
  StatedLook look;
};

struct NgffImage {
  std::string where;                       ///< for messages: the document, up to "multiscales[0]"
  std::vector<NgffAxis> axes = {};         ///< in the order of the arrays' axes
  std::vector<NgffLevel> levels = {};      ///< the finest first; at least one
  std::vector<NgffChannel> channels = {};  ///< of omero; there may be none
};

/// The type of an axis that is known by its name only, as all were before 0.4; "" if it is not known.
std::string ngffAxisType(const std::string& name);

/// The attributes in which a group's OME metadata stand: those of "ome" if it has any.
ZarrField ngffAttributes(const ZarrNode& group);

/// The image of a group, or none if it has no multiscales. Throws Error: badInput for metadata that the
/// format forbids, unsupported for transformations other than scale and translation.
std::optional<NgffImage> ngffImageOf(const ZarrNode& group, const Warn& warn);

}  // namespace scolopax::io
