// SPDX-License-Identifier: Apache-2.0
// A file, plain or gzip, read from front to back, that knows the most bytes it can hold before any are read.
// Between the files on disk and every loader that parses its format itself.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace scolopax::io {

/// Throws Error unless the path is a regular file: notFound, io if it cannot be opened, or badInput for a
/// folder, a pipe or a device. Never blocks.
void requireRegularFile(const std::filesystem::path& path);

/// Path of the file that a header names. Throws Error(badInput), naming the header and its field, unless the
/// file lies in or below the header's own folder (no absolute path, no "..", no link out of it), and
/// Error(notFound) if neither the file nor, with `packedEnding` (".gz"), its packed form exists.
std::filesystem::path resolveDataFile(const std::filesystem::path& header, std::string_view field,
                                      std::string_view name, std::string_view packedEnding = {});

class ByteStream {
 public:
  /// plain: the bytes as they are. gzip: must be gzip. detect: gzip if the file starts like gzip.
  enum class Encoding { plain, gzip, detect };
  /// Opens at `offset` of the file. Throws like requireRegularFile, and Error(badInput) if it must be gzip
  /// and is not.
  ByteStream(const std::filesystem::path& path, Encoding encoding, std::uint64_t offset = 0);
  ~ByteStream();
  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) = delete;

  /// Fills `bytes`, or throws Error(badInput) saying where the data ended.
  void read(std::span<std::byte> bytes);
  /// Reads up to bytes.size() bytes and returns how many it read; fewer only at the end.
  std::size_t readSome(std::span<std::byte> bytes);
  void skip(std::uint64_t count);
  /// True if nothing is left; for gzip this also verifies the checksum of what was read.
  bool atEnd();

  bool compressed() const;
  /// Bytes read or skipped so far, after decompression.
  std::uint64_t position() const;
  /// Upper bound of position(): the bytes of the file from `offset` on, for gzip times 1032, the most that
  /// deflate expands.
  std::uint64_t largestSize() const;
  const std::filesystem::path& path() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scolopax::io
