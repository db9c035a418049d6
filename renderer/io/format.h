// SPDX-License-Identifier: Apache-2.0
// Volume files: one .cpp per format, one entry in the list of formats.cpp. A loader turns files into
// grids and channel sources; Volume measures them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/volume.h"

namespace scolopax::io {

/// Called with one line for each thing that loading changed (a widened or narrowed type, a skipped field).
using Warn = std::function<void(const std::string&)>;

/// What one file holds, with the files that its header names: channels on one grid.
struct LoadedFile {
  Grid grid;
  std::vector<ChannelSource> channels;
  std::filesystem::path dataFile;  ///< where the voxels are, when the file is only their header; else empty
};

struct Format {
  std::string_view name;        ///< "NIfTI"
  std::string_view extensions;  ///< for --help: ".nii, .nii.gz, .hdr + .img"
  /// Whether this loader is the one for the file, judged by its name.
  bool (*matches)(const std::filesystem::path& path);
  /// Throws Error with one line: file, field, expected, found. Sizes are checked against `memoryLimitBytes`
  /// and against the file before memory is allocated.
  LoadedFile (*load)(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);
};

/// Every format, in the order in which they are tried.
std::span<const Format> formats();

/// Loads one file with the first format that matches; throws Error(unsupported) naming the known ones.
LoadedFile loadFile(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);

/// A data set: files whose grids agree become the channels of one volume, in the order given.
struct LoadedDataset {
  std::string id;     ///< slug of the first file's stem, made unique among the data sets by a suffix
  std::string title;  ///< the first file's name, and how many more there are: "a.nrrd +2"
  std::vector<std::filesystem::path> files;
  std::shared_ptr<const Volume> volume;
};

/// Loads the files and groups those whose grids agree (sameGrid), in the order of first appearance. A data
/// file whose header is also among the files is loaded only through that header.
std::vector<LoadedDataset> loadDatasets(std::span<const std::filesystem::path> paths,
                                        std::uint64_t memoryLimitBytes, const Warn& warn);

/// The default limit: half of the machine's memory, or 4 GiB if that is unknown.
std::uint64_t defaultMemoryLimitBytes();

// One loader per format; each in its own .cpp.
bool matchesNifti(const std::filesystem::path& path);
LoadedFile loadNifti(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);
bool matchesNrrd(const std::filesystem::path& path);
LoadedFile loadNrrd(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);
bool matchesTiff(const std::filesystem::path& path);
LoadedFile loadTiff(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);
bool matchesRaw(const std::filesystem::path& path);
LoadedFile loadRaw(const std::filesystem::path& path, std::uint64_t memoryLimitBytes, const Warn& warn);

/// Writes an attached, raw-encoded NRRD (LPS space) with the channels as the slowest axis; all must have one
/// type.
void writeNrrd(const std::filesystem::path& path, const Grid& grid, std::span<const ChannelSource> channels);

}  // namespace scolopax::io
