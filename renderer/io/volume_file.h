// SPDX-License-Identifier: Apache-2.0
// What a reader makes of a file: what the file holds, by its headers, and a function that reads voxels.
// Between the readers and datasets.h. How to write a reader: docs/adding-a-reader.md.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/channel_writer.h"
#include "renderer/io/loading.h"
#include "renderer/io/stored_type.h"

namespace scolopax::io {

/// One channel, as the headers describe it.
struct ChannelInfo {
  std::string name = {};  ///< "": openFile names it after the volume or the file
  std::string unit = {};
  StoredType type = StoredType::u8;  ///< of the voxels that the reader writes
  double slope = 1.0;                ///< data value = slope * stored + intercept; slope != 0
  double intercept = 0.0;
  StatedLook look = {};  ///< what the file says; nothing where it only has its format's default
};

/// The points in time of a volume.
struct Times {
  std::size_t count = 1;
  std::vector<double> values = {};  ///< `count` of them, or none if the file does not tell
  std::string unit = {};            ///< of the values; "" if unknown
};

/// Channels on one grid: a data set, a series or a variable of a file.
struct VolumeInfo {
  std::string path = {};  ///< inside the file, without "/" at its ends; "" for the only volume of a file
  std::vector<Grid> levels = {};  ///< of resolution, the finest first; at least one
  Times times = {};
  std::vector<ChannelInfo> channels = {};  ///< at least one; there may be more than a Volume can have
  std::string worldUnit = {};              ///< "mm", "um", ...; "" if unknown
  bool derived = false;                    ///< computed from others: only derived volumes join it
  /// Of a derived volume: bytes, unpacked, of all that is read for these channels of a level, which are at
  /// least one.
  std::function<std::uint64_t(std::size_t level, const std::vector<std::size_t>& channels)> readBytes = {};
};

/// What of a file is to be read.
struct Part {
  std::size_t volume = 0, level = 0, time = 0;  ///< indices
  std::vector<std::size_t> channels = {};       ///< indices, ascending; readers get at least one. Empty: all
};

/// How to see an axis of a file that is neither x, y nor z. Readers get members as times.
enum class FourthAxis { automatic, time, channel, member };

struct OpenOptions {
  FourthAxis fourthAxis = FourthAxis::automatic;  ///< for formats that do not say what the axis is
  Warn warn = {};                                 ///< never empty where a reader gets it
  std::stop_token stop = {};                      ///< for readers that look at many files
  /// Servers that may be asked by HTTP: "host", for the usual ports, or "host:port".
  std::vector<std::string> allowedHosts = {};
};

/// A file or folder whose headers have been read. It keeps neither voxels nor an open file.
struct VolumeFile {
  std::filesystem::path path;
  std::vector<VolumeInfo> volumes = {};
  /// Other files or folders that hold this one's voxels: given together with it, they are not opened by
  /// themselves.
  std::vector<std::filesystem::path> dataFiles = {};
  /// Reads the part's channels, in its order, at the size of its level; openFile and load() have checked
  /// indices and memory. Reads the file anew and trusts nothing of it, as it may have changed. May be called
  /// from several threads at once.
  std::function<std::vector<VoxelBuffer>(const VolumeInfo& volume, const Part& part, Loading& loading)> read =
      {};
};

/// A writer for each channel of the part.
std::vector<ChannelWriter> makeWriters(const std::string& file, const VolumeInfo& volume, const Part& part,
                                       Loading& loading);

/// Memory that a level's channels need once loaded, at most, and bytes that its voxels have in the file,
/// unpacked; of a derived volume, those of all that is read for it. Without `channels`, of all. Saturate.
std::uint64_t memoryBytes(const VolumeInfo& volume, std::size_t level,
                          const std::vector<std::size_t>& channels = {});
std::uint64_t storedBytes(const VolumeInfo& volume, std::size_t level,
                          const std::vector<std::size_t>& channels = {});

/// "13x7x3 uint16, 2 channels".
std::string description(const VolumeInfo& volume, std::size_t level,
                        const std::vector<std::size_t>& channels = {});

/// Channels on one grid.
struct LoadedPart {
  Grid grid;
  std::vector<ChannelSource> channels;
};

/// Reads a part; its channels come in ascending order. Throws Error: badInput for an index beyond what there
/// is or a damaged file, tooLarge if the memory limit does not allow it, cancelled, and what the reader
/// throws.
LoadedPart load(const VolumeFile& file, const Part& part, Loading& loading);
LoadedPart load(const VolumeFile& file, const Part& part, const LoadOptions& options);

}  // namespace scolopax::io
