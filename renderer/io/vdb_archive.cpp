// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vdb_archive.h"

#if SCOLOPAX_HAS_OPENVDB
#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {

using openvdb::GridBase;
using openvdb::io::GridDescriptor;

namespace {
constexpr std::int32_t kMostVdbGrids = 4096;
}  // namespace

VdbArchive::VdbArchive(const std::filesystem::path& path)
    : file_(shown(path)), stream_(path, std::ios::binary), metadata_(new openvdb::io::StreamMetadata) {
  openvdb::initialize();
  stream_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
  Archive::readHeader(stream_);
  if (!inputHasGridOffsets() || fileVersion() < openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING)
    throw Error(ErrorCode::unsupported,
                file_ + ": expected the places of the grids and version " +
                    std::to_string(int(openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING)) +
                    " or later, found version " + std::to_string(fileVersion()) +
                    (inputHasGridOffsets() ? "" : " without places"));
  metadata_->setSeekable(true);
  openvdb::io::setStreamMetadataPtr(stream_, metadata_, false);
  setFormatVersion(stream_);
  setLibraryVersion(stream_);
  setDataCompression(stream_);
  openvdb::MetaMap ofFile;
  ofFile.readMeta(stream_);
  const std::int32_t count = readGridCount(stream_);
  if (count > kMostVdbGrids)
    throw Error(ErrorCode::unsupported, file_ + ": expected at most " + std::to_string(kMostVdbGrids) +
                                            " grids, found " + std::to_string(count));
  for (std::int32_t i = 0; i < count; ++i) {
    GridDescriptor entry;
    entry.read(stream_);
    entries_.push_back(entry);
    entry.seekToEnd(stream_);
  }
  std::ranges::stable_sort(entries_, {}, &GridDescriptor::uniqueName);
}

std::string VdbArchive::nameOf(std::size_t grid) const {
  return GridDescriptor::nameAsString(entries_[grid].uniqueName());
}

const GridBase::Ptr& VdbArchive::readOne(const GridDescriptor& entry, bool whole) {
  const auto& grid = *new GridBase::Ptr(GridBase::createGrid(entry.gridType()));
  grid->setSaveFloatAsHalf(entry.saveFloatAsHalf());
  entry.seekToGrid(stream_);
  if (whole) {
    Archive::readGrid(grid, entry, stream_);
  } else {
    readGridCompression(stream_);
    grid->readMeta(stream_);
    grid->readTransform(stream_);
  }
  return grid;
}

const GridBase& VdbArchive::readHeader(std::size_t grid) { return *readOne(entries_[grid], false); }

const GridBase& VdbArchive::readGrid(std::size_t grid) {
  const GridDescriptor& entry = entries_[grid];
  const GridBase::Ptr& own = readOne(entry, true);
  if (!entry.isInstance()) return *own;
  const auto parent = std::ranges::find(entries_, entry.instanceParentName(), &GridDescriptor::uniqueName);
  if (parent == entries_.end() || parent->isInstance() || parent->gridType() != entry.gridType())
    throw Error(ErrorCode::badInput, file_ + ": grid " + inQuotes(nameOf(grid)) +
                                         ": expected a grid with a tree to share, found " +
                                         inQuotes(entry.instanceParentName()));
  own->setTree((*readOne(*parent, true)).baseTreePtr());
  return *own;
}

}  // namespace scolopax::io
#endif
