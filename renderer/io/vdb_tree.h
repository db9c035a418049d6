// SPDX-License-Identifier: Apache-2.0
// The grids of an OpenVDB file, as a child process finds them by OpenVDB. Its users see no type of OpenVDB.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "renderer/io/apart.h"
#include "renderer/io/stored_type.h"

namespace scolopax::io {

/// A grid of an OpenVDB file, by its header.
struct VdbGrid {
  StoredType type = StoredType::f32;
  std::int32_t components = 1;     ///< 3 for vectors
  glm::ivec3 first{0}, last{0};    ///< active voxels lie from the first to the last index, inclusive
  glm::dmat4 worldFromIndex{1.0};  ///< affine
};

/// Begins each record of voxels that sendVdbVoxels sends; `bytes` bytes of values follow, the components of a
/// voxel side by side. A message holds whole records.
struct VdbRecord {
  enum class Kind : std::uint32_t {
    background,  ///< one voxel, the value of all that no other record has; once for each grid, before others
    constant,    ///< one voxel, the value of a whole box
    leaf         ///< a box of 8x8x8 voxels, z fastest
  };
  Kind kind = Kind::background;
  std::uint32_t grid = 0;  ///< index in the list of names
  StoredType type = StoredType::u8;
  std::int32_t components = 1;
  std::array<std::int32_t, 3> first{}, size{};  ///< of the box, in index space
  std::uint64_t bytes = 0;
};

/// In the child: sends a message for each grid, a VdbGrid and then its name, which is unique: "density[1]"
/// for the second of that name. Warns of grids that cannot be shown. Throws Error if there are no others.
void sendVdbGrids(const std::filesystem::path& path, const Sender& sender);

/// In the child: sends the voxels of the grids with these names, those inactive included. Throws
/// Error(badInput) if a grid is active outside first to last, which its header stated.
void sendVdbVoxels(const std::filesystem::path& path, const std::vector<std::string>& names,
                   const glm::ivec3& first, const glm::ivec3& last, const Sender& sender);

}  // namespace scolopax::io
