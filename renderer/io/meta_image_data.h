// SPDX-License-Identifier: Apache-2.0
// The elements of a MetaImage as one sequence of bytes, whatever files they lie in. Between the files on disk
// and meta_image.cpp.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "renderer/io/loading.h"
#include "renderer/io/meta_image_header.h"

namespace scolopax::io {

/// Where the elements are: files that each hold as many, one after the other.
struct MetaImageData {
  std::vector<std::filesystem::path> files = {};
  std::uint64_t pieceBytes = 0;   ///< of the elements in each file, unpacked
  std::uint64_t start = 0;        ///< of the elements in each file
  bool atEnd = false;             ///< they are the last bytes of each file instead
  bool packed = false;            ///< by zlib or gzip
  std::uint64_t packedBytes = 0;  ///< in the file; 0: all that follow `start`
};

/// Finds the elements: behind the header, in a file, in a list of files or in files numbered by a pattern.
/// `dims` are all of the header's, `elementBytes` with all channels. Checks that every file is large enough.
/// Throws Error as resolveDataFile, and badInput for a file that is too short and for the wrong number of
/// files.
MetaImageData findMetaImageData(const MetaImageHeader& header, const std::filesystem::path& path,
                                std::span<const std::int64_t> dims, std::uint64_t elementBytes);

/// Reads the elements from front to back.
class MetaImageStream {
 public:
  MetaImageStream(const MetaImageData& data, Loading& loading);
  ~MetaImageStream();
  MetaImageStream(const MetaImageStream&) = delete;
  MetaImageStream& operator=(const MetaImageStream&) = delete;

  /// Goes on to this byte of the elements, which must not lie before those that have been read.
  void skipTo(std::uint64_t position);
  /// Throws Error(badInput) if the data are damaged or end early.
  void read(std::span<std::byte> bytes);

 private:
  class File;
  File& openPiece(std::uint64_t index);

  const MetaImageData& data_;
  Loading& loading_;
  std::uint64_t position_ = 0, pieceIndex_ = 0;
  std::unique_ptr<File> piece_;
};

}  // namespace scolopax::io
