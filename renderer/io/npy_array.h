// SPDX-License-Identifier: Apache-2.0
// One array in NumPy's format (numpy.org/doc/stable/reference/generated/numpy.lib.format.html) as a volume,
// in a file of its own (npy.cpp) or in an archive (npz.cpp).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/io/volume_file.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {

inline constexpr std::string_view kNpyMagic = "\x93NUMPY";

/// The bytes of an array's file, from front to back. Both throw Error(badInput) if it ends early.
class NpySource {
 public:
  virtual ~NpySource() = default;
  virtual void read(std::span<std::byte> bytes) = 0;
  virtual void skip(std::uint64_t count) = 0;
};

/// What the header says.
struct NpyHeader {
  StoredType type = StoredType::u8;
  bool bigEndian = false, fortranOrder = false;
  std::vector<std::int64_t> shape = {};
  std::uint64_t dataOffset = 0;  ///< of the first element in the file
};

/// Reads the header of version 1, 2 or 3. `where` begins errors: the file, and the array in it. Throws
/// Error: badInput for a header that is none, unsupported for elements that are not numbers.
NpyHeader readNpyHeader(const std::string& where, NpySource& source);

/// How the array makes up a volume.
struct NpyArray {
  VoxelLayout layout = {};       ///< as the elements lie in the file
  bool fortranOrder = false;     ///< z varies fastest, x slowest
  bool samplesAreTimes = false;  ///< otherwise they are channels
  std::uint64_t dataOffset = 0;
};

/// The last three axes are z, y and x; docs/files.md states the rule for a fourth one. Throws
/// Error(unsupported) for more, and as checkedDims.
NpyArray arrangeNpy(const std::string& where, const NpyHeader& header, FourthAxis fourthAxis);

VolumeInfo npyVolume(const NpyArray& array);

/// Reads the part's channels at its time; the source is at the file's first byte.
std::vector<VoxelBuffer> readNpyVoxels(const std::string& where, const NpyArray& array, NpySource& source,
                                       const VolumeInfo& volume, const Part& part, Loading& loading);

}  // namespace scolopax::io
