// SPDX-License-Identifier: Apache-2.0
// Parts of the reader of HDF5: layouts of particular programs, of which each looks at what a file holds and
// makes volumes of it if the layout is its own.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "renderer/io/array_slabs.h"
#include "renderer/io/array_tree.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// Whether the file begins as HDF5, perhaps after a block of another program's.
bool isHdf5(std::string_view bytes);

/// An open HDF5 file, for the layouts.
struct Hdf5File {
  std::filesystem::path path;
  std::string name;  ///< for messages
  ArrayTree tree;
  const OpenOptions& options;
};

/// None if the layout is another.
std::optional<VolumeFile> openImarisLayout(const Hdf5File& file);
std::optional<VolumeFile> openPmdLayout(const Hdf5File& file);
std::optional<VolumeFile> openMincLayout(const Hdf5File& file);

}  // namespace scolopax::io
