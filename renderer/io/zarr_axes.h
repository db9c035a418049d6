// SPDX-License-Identifier: Apache-2.0
// Which axis of a Zarr array is which, and units of NGFF axes.
#pragma once
#include <glm/vec3.hpp>
#include <string>
#include <utility>
#include <vector>

#include "renderer/io/ngff.h"
#include "renderer/io/zarr_chunks.h"

namespace scolopax::io {

/// By type and name; spatial axes of other names are z, y, x in their order. There are as many axes as the
/// array has. Throws Error(unsupported), beginning with `where`, for two axes of one kind, and for others of
/// more than one voxel.
ZarrAxes zarrAxesOf(const std::string& where, const std::vector<NgffAxis>& named, const ZarrArray& array);

/// Voxels along x, y, z. Throws as checkedDims.
glm::ivec3 zarrDimsOf(const std::string& where, const ZarrArray& array, const ZarrAxes& axes);
/// Length of an axis, 1 if there is none. Throws Error(unsupported) beyond `most`.
std::size_t zarrLengthOf(const std::string& where, const ZarrArray& array, std::optional<std::size_t> axis,
                         std::int64_t most);

/// The unit in which a volume is shown ("um" for "micrometer"), and the factors that turn x, y, z into it.
/// Units that cannot be combined are left out with a warning.
std::pair<std::string, glm::dvec3> ngffWorldUnit(const NgffImage& image, const ZarrAxes& axes,
                                                 const Warn& warn);
/// "s" for "second"; a unit that is not known as it is.
std::string ngffTimeUnit(const std::string& unit);

}  // namespace scolopax::io
