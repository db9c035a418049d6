// SPDX-License-Identifier: Apache-2.0
// Grids of NetCDF variables by the CF conventions (cfconventions.org) and those of WRF. Part of the reader of
// NetCDF.
#pragma once
#include <string>

#include "renderer/data/volume.h"
#include "renderer/io/array_tree.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// A letter for each dimension of a variable: x, y, z; t: times; c: another one; '-': another of length 1.
/// "" if it has fewer than two dimensions beside the times, or more than one other.
std::string netcdfRoles(const ArrayTree& tree, const ArrayNode& variable);

struct NetcdfGrid {
  Grid grid;
  std::string unit = {};
  std::string warning = {};  ///< what is not as the file says; "" if all is
};
/// `where` begins errors. Axes without even coordinates in the unit of x get the mean spacing of the others.
NetcdfGrid netcdfGrid(const std::string& where, const ArrayTree& tree, const ArrayNode& variable,
                      const std::string& roles);
Times netcdfTimes(const ArrayTree& tree, const ArrayNode& variable, const std::string& roles);

}  // namespace scolopax::io
