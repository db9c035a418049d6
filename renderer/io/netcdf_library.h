// SPDX-License-Identifier: Apache-2.0
// NetCDF files by libnetcdf, in a child process (apart.h). Between
// array_tree.h, array_slabs.h and the library.
#pragma once
#include <filesystem>

#include "renderer/io/array_slabs.h"
#include "renderer/io/array_tree.h"

namespace scolopax::io {

/// Sends a node for every group and variable, with the values of those of one
/// dimension.
void scanNetcdf(const std::filesystem::path& path, const Sender& sender);
OpenArrays openNetcdfArrays(const std::filesystem::path& path);

}  // namespace scolopax::io
