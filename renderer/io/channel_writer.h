// SPDX-License-Identifier: Apache-2.0
// Takes the voxels of one channel as a reader finds them, in any order, and keeps them in one of the types of
// volumes. Converting while reading, it never holds a channel twice.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/loading.h"
#include "renderer/io/stored_type.h"

namespace scolopax::io {

class ChannelWriter {
 public:
  /// `file` begins warnings and errors. Throws Error(tooLarge) if there is no memory for the voxels.
  ChannelWriter(std::string file, StoredType type, glm::ivec3 dims, Loading& loading);

  // The functions that write may be called from several threads at once, for different voxels. `stored` need
  // not be aligned. They throw Error(cancelled) if the load is to end.

  /// Writes consecutive voxels, x fastest, from voxel `first` on; `stored` are their bytes.
  void write(std::size_t first, std::span<const std::byte> stored, bool bigEndian = false);
  /// Writes `count` consecutive voxels of which one begins every `strideBytes`: one of interleaved channels.
  void writeStrided(std::size_t first, std::size_t count, const std::byte* stored, std::ptrdiff_t strideBytes,
                    bool bigEndian = false);
  /// Writes the part of a box (a chunk, a tile, a brick) that lies in the volume. The voxel that is `at` from
  /// the box's `first` one begins strideBytes * at after `stored`, so any order of axes, and by negative
  /// strides any direction, will do. `first` may be negative.
  void writeBox(const glm::ivec3& first, const glm::ivec3& size, const std::byte* stored,
                const std::array<std::ptrdiff_t, 3>& strideBytes, bool bigEndian = false);
  /// Gives all voxels one stored value, rounded and limited to the type's range; for files that leave voxels
  /// out. Before all writes.
  void fill(double value);

  const glm::ivec3& dims() const { return dims_; }
  StoredType type() const { return type_; }

  /// The voxels, at the end. Warns if they were converted, saying what was lost. Throws Error(badInput)
  /// unless as many voxels have been written as there are, or all were filled.
  VoxelBuffer take();

 private:
  void put(std::size_t first, std::size_t count, const std::byte* stored, std::ptrdiff_t strideBytes,
           bool bigEndian);
  void convert(std::size_t first, std::size_t count, const std::byte* values);
  template <class From, class To>
  void copy(std::size_t first, std::size_t count, const std::byte* values, To (*convertOne)(From));
  template <class From>
  void round(std::size_t first, std::size_t count, const std::byte* values);
  template <class From>
  void narrow(std::size_t first, std::size_t count, const std::byte* values);
  void changeToFloat();
  std::string loss() const;

  std::string file_;
  StoredType type_;
  glm::ivec3 dims_;
  Loading* loading_;
  VoxelBuffer voxels_;
  /// What concurrent writes share; on the heap, so that writers can be moved.
  struct Shared {
    std::mutex mutex;
    std::size_t written = 0;
    bool filled = false;
    std::int64_t lowest = 0, highest = 0;  ///< of 32-bit integers, and 0
    double largestError = 0;               ///< relative, of rounding
    std::size_t infinite = 0;              ///< values that became infinite
  };
  std::unique_ptr<Shared> shared_;
};

/// What all of the writers hold, in order.
std::vector<VoxelBuffer> takeAll(std::vector<ChannelWriter>& writers);

}  // namespace scolopax::io
