// SPDX-License-Identifier: Apache-2.0
// Data sets: volumes on one grid, of one file or several, become the channels of one volume. From the names
// that users give to volumes in memory.
#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// A path, and what of the file is meant: "file.h5:/a/b".
struct DataName {
  std::filesystem::path path;
  std::string inner = {};  ///< "": all that can be shown
};

/// Splits at the first colon before which a file or folder exists. A path that exists as it stands is not
/// split, nor is one of which no part exists. URLs are split at the first colon behind the host.
DataName splitName(const std::filesystem::path& name);

/// What `inner` selects of a file: the volume with this path, or all below it, or channels of this name; ""
/// selects all. Throws Error(notFound), telling what there is.
std::vector<Part> partsOf(const VolumeFile& file, const std::string& inner);

/// A data set whose headers have been read and whose voxels have not.
struct Dataset {
  /// Slug of the first file's stem and, if the file has several data sets, the first volume's path; made
  /// unique among the data sets by a suffix.
  std::string id = {};
  /// The first file's name, and how many more files there are: "a.nrrd +2". If the file has several data
  /// sets, followed by the first volume's path, and how many more volumes there are: "wrf.nc:P +5".
  std::string title = {};
  std::vector<std::filesystem::path> files = {};
  std::vector<Grid> levels = {};           ///< that all parts have, the finest first
  Times times = {};                        ///< parts with a single time hold at all of them
  std::vector<ChannelInfo> channels = {};  ///< of all parts in order, with short names
  std::string worldUnit = {};
  struct Source {
    std::shared_ptr<const VolumeFile> file;
    Part part;  ///< at level 0 and time 0
  };
  std::vector<Source> sources = {};
};

/// Opens what the names say. In place of a folder, unless a format claims all of it, come the volumes in it
/// (volumesIn); those that fail are left out with a warning. Numbered files become the steps of a series
/// (joinSeries), unless options.fourthAxis is channel. Then groups volumes whose finest grids agree
/// (sameGrid) and whose times do, or that have only one, in the order of first appearance; those in a folder
/// only with others of the same folder, as long as there is room. A data file whose header is also among the
/// files is read only through that header. Throws Error: notFound for something that is not in a file,
/// unsupported for more than kMaxChannels on one grid, naming what there is to choose from, and as openFile.
std::vector<Dataset> openDatasets(std::span<const std::filesystem::path> names,
                                  const OpenOptions& options = {});

/// Memory that the data set needs once loaded, at most.
std::uint64_t memoryBytes(const Dataset& dataset, std::size_t level = 0);

/// Throws Error as load() and Volume.
std::shared_ptr<const Volume> loadVolume(const Dataset& dataset, std::size_t level, std::size_t time,
                                         const LoadOptions& options);

/// A data set and its voxels, at one level and time.
struct LoadedDataset {
  std::string id;
  std::string title;
  std::vector<std::filesystem::path> files;
  std::shared_ptr<const Volume> volume;
  Times times = {};
  std::string worldUnit = {};
};

/// Loads the data sets at their finest level and at one time. The memory limit is for all of them together.
std::vector<LoadedDataset> loadDatasets(std::span<const Dataset> datasets, std::size_t time,
                                        LoadOptions options);
/// Opens and loads, at the first time.
std::vector<LoadedDataset> loadDatasets(std::span<const std::filesystem::path> names,
                                        std::uint64_t memoryLimitBytes, const Warn& warn);

}  // namespace scolopax::io
