// SPDX-License-Identifier: Apache-2.0
// An OpenVDB file, by OpenVDB's own functions, but on a stream that reports where the file ends: io::File
// does not notice, and goes on with what it has not read. For child processes, as nothing that is read is
// freed: freeing a tree starts TBB, which a child process cannot have.
#pragma once
#if SCOLOPAX_HAS_OPENVDB
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace scolopax::io {

class VdbArchive : public openvdb::io::Archive {
 public:
  /// Reads the list of grids. Throws Error: badInput if the file is damaged, unsupported for files that do
  /// not tell where their grids are.
  explicit VdbArchive(const std::filesystem::path& path);

  std::size_t gridCount() const { return entries_.size(); }
  /// Unique: "density[1]" for the second of that name.
  std::string nameOf(std::size_t grid) const;
  /// Metadata and transform, with an empty tree. These throw std::exception if the file is damaged.
  const openvdb::GridBase& readHeader(std::size_t grid);
  /// The whole grid.
  const openvdb::GridBase& readGrid(std::size_t grid);

 private:
  const openvdb::GridBase::Ptr& readOne(const openvdb::io::GridDescriptor& entry, bool whole);

  std::string file_;
  std::ifstream stream_;
  openvdb::io::StreamMetadata::Ptr metadata_;
  std::vector<openvdb::io::GridDescriptor> entries_;
};

}  // namespace scolopax::io
#endif
