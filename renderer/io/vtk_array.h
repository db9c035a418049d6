// SPDX-License-Identifier: Apache-2.0
// One array of a VTK file and the numbers in it, in whichever way they are written: as text, as base64 or as
// raw bytes, in compressed blocks or not. Between VtkChars and vtk_dataset.h.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/io/loading.h"
#include "renderer/io/stored_type.h"
#include "renderer/io/vtk_chars.h"

namespace scolopax::io {

enum class VtkCoding { ascii, base64, raw };
enum class VtkCompressor { none, zlib, lz4 };

/// What a file says of an array, and where its numbers are.
struct VtkArray {
  std::string file = {};  ///< for messages
  std::string name = {};
  StoredType type = StoredType::u8;
  bool bits = false;  ///< eight values in each byte of the file, the highest bit first; `type` is u8
  std::size_t components = 1;
  std::vector<std::string> componentNames = {};  ///< as many as the file tells

  std::filesystem::path path = {};
  std::uint64_t begin = 0, end = 0;  ///< bytes of the file
  bool gzip = false;                 ///< the file may be packed; then `end` is the most that it can become
  VtkCoding coding = VtkCoding::raw;
  VtkCompressor compressor = VtkCompressor::none;  ///< not of ascii
  bool bigEndian = false;
  std::size_t headerBytes =
      0;  ///< of each number that tells sizes before the data: 4 or 8; 0: there are none

  /// "FILE: array "name"".
  std::string where() const;
};

/// One line: where, expected, found.
Error badVtk(const std::string& where, const std::string& expected, std::string_view found);
Error unsupportedVtk(const std::string& where, const std::string& expected, std::string_view found);

/// Throws Error(badInput) if the file is too short for so many numbers even if they are packed as well as
/// they can be. Allocates nothing.
void checkVtkArrayFits(const VtkArray& array, std::uint64_t count);

/// The numbers of an array, from the first one on.
class VtkArrayReader {
 public:
  /// `count` numbers are expected. Throws Error(badInput) if the array says that it has another size. The
  /// memory of compressed blocks is checked with `loading`, if there is one.
  VtkArrayReader(const VtkArray& array, std::uint64_t count, const Loading* loading);

  /// Fills `bytes` with the next numbers, or throws Error(badInput). bigEndian() is their byte order.
  void read(std::span<std::byte> bytes);
  bool bigEndian() const { return array_.coding != VtkCoding::ascii && array_.bigEndian; }

 private:
  void readWords(std::span<std::byte> bytes);
  void readBits(std::span<std::byte> bytes);
  void readStored(std::span<std::byte> bytes);
  void nextTriple();
  void readSizes(std::uint64_t expectedBytes);
  std::uint64_t readSize();
  void nextBlock();

  const VtkArray array_;
  const Loading* loading_;
  VtkChars chars_;
  /// Decoded from four characters of base64, the last `tripleLeft_` of which are not read yet.
  std::byte triple_[3];
  std::size_t tripleSize_ = 0, tripleAt_ = 0;
  bool padded_ = false;  ///< a '=' has ended the base64
  unsigned bitByte_ = 0, bitsLeft_ = 0;
  std::vector<std::uint64_t> packedSizes_;  ///< of all blocks
  std::uint64_t blockBytes_ = 0, bytesLeft_ = 0;
  std::size_t nextBlock_ = 0, blockAt_ = 0;
  std::vector<std::byte> packed_, block_;
};

/// All numbers of a short array.
std::vector<double> readVtkNumbers(const VtkArray& array, std::uint64_t count);

}  // namespace scolopax::io
