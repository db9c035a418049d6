// SPDX-License-Identifier: Apache-2.0
// Reads volumes out of arrays of more dimensions, piece by piece, by a library in a child process.
// Between the readers of array files (array_tree.h) and their libraries.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/array_tree.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// Voxels from a child: a box of the volume. Voxel (x,y,z) of it begins (x,y,z) * strideBytes after `bytes`.
struct ArrayBox {
  glm::ivec3 first, size;
  std::array<std::ptrdiff_t, 3> strideBytes;
  std::span<const std::byte> bytes;
};

/// The part of an array that is one volume. Lists have one entry for each dimension, the slowest first.
struct ArraySlab {
  std::string path;
  StoredType type = StoredType::u8;  ///< in which the library gives the numbers
  std::uint64_t chunkBytes = 0;
  std::vector<std::uint64_t> dims = {};  ///< of the whole array, as its headers told
  std::vector<std::uint64_t> first = {}, count = {};
  std::array<int, 3> axes{-1, -1, -1};  ///< which dimensions are x, y and z; -1: there is none
  /// Changes the numbers of a box to those of the channel; without it they are the same. Runs in this
  /// process.
  std::function<std::vector<float>(const ArrayBox&)> convert = {};
};

/// A slab of the node, of which `roles` has a letter for each dimension: x, y, z; t: index `time`; c: index
/// `channel`; any other: index 0.
ArraySlab slabOf(const ArrayNode& node, std::string_view roles, std::size_t time = 0,
                 std::size_t channel = 0);

/// The sizes of the dimensions that `roles` calls x, y and z; 1 without one. `where` begins errors. Throws
/// Error as checkedDims.
glm::ivec3 dimsOf(const std::string& where, const ArrayNode& node, std::string_view roles);
/// The size of the dimension with this role; 1 without one.
std::uint64_t lengthOf(const ArrayNode& node, std::string_view roles, char role);

/// An array that a library has opened, in the child.
struct OpenArray {
  std::vector<std::uint64_t> chunk;  ///< the shape that is read fast; 1s if any is
  /// Reads a box, packed.
  std::function<void(std::span<const std::uint64_t> first, std::span<const std::uint64_t> count,
                     std::byte* to)>
      read;
};
/// Opens an array of the file; what the slab's `type` and `dims` say is to be checked against the file.
using OpenArrays = std::function<OpenArray(const ArraySlab&)>;
/// Opens the file, in the child.
using OpenArrayFile = std::function<OpenArrays(const std::filesystem::path&)>;

/// Reads slabs in pieces of at most 16 MiB and calls `take` with each and its slab's index. Throws Error as
/// runApart, and tooLarge if a chunk needs more memory than the load may have.
void readSlabs(const OpenArrayFile& open, const std::filesystem::path& path,
               const std::vector<ArraySlab>& slabs, Loading& loading,
               const std::function<void(std::size_t slab, const ArrayBox&)>& take);

/// Reads the slab of each channel of the part.
std::vector<VoxelBuffer> readSlabs(const OpenArrayFile& open, const std::filesystem::path& path,
                                   const std::vector<ArraySlab>& slabs, const VolumeInfo& volume,
                                   const Part& part, Loading& loading);

/// change(number, voxel) of every voxel of a box whose numbers have this type.
template <class Change>
std::vector<float> convertedBox(const ArrayBox& box, StoredType type, Change&& change) {
  std::vector<float> values(box.bytes.size() / sizeBytes(type));
  const auto convert = [&]<class T>(T) {
    for (int z = 0; z < box.size.z; ++z)
      for (int y = 0; y < box.size.y; ++y)
        for (int x = 0; x < box.size.x; ++x) {
          const std::ptrdiff_t at = x * box.strideBytes[0] + y * box.strideBytes[1] + z * box.strideBytes[2];
          T number;
          std::memcpy(&number, box.bytes.data() + at, sizeof(T));
          values[std::size_t(at) / sizeof(T)] = change(double(number), box.first + glm::ivec3(x, y, z));
        }
  };
  switch (type) {
#define X(name, numpyName, T) \
  case StoredType::name:      \
    convert(T());             \
    break;
    SCOLOPAX_STORED_TYPES(X)
#undef X
  }
  return values;
}

}  // namespace scolopax::io
