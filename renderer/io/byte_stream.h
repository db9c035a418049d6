// SPDX-License-Identifier: Apache-2.0
// A file read from front to back, plain or gzip, that knows how much it can hold before anything is read.
// Between the files on disk and every loader that parses its format itself.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace scolopax::io {

/// Throws Error unless the path is a regular file: notFound, or badInput for a folder, a pipe, a device.
/// Never blocks.
void requireRegularFile(const std::filesystem::path& path);

/// The file that a header names. Throws Error(badInput) naming the header and its field unless the name
/// stays in or below the header's own folder (no absolute path, no "..", no link out of it), and
/// Error(notFound) when neither it nor, with `packedEnding` (".gz"), its packed form is there.
std::filesystem::path resolveDataFile(const std::filesystem::path& header, std::string_view field,
                                      std::string_view name, std::string_view packedEnding = {});

class ByteStream {
 public:
  /// plain: the bytes as they are. gzip: must be gzip. detect: gzip when the file starts like it.
  enum class Encoding { plain, gzip, detect };
  /// Opens at `offset` of the file. Throws as requireRegularFile, or Error(badInput) when it is not gzip.
  ByteStream(const std::filesystem::path& path, Encoding encoding, std::uint64_t offset = 0);
  ~ByteStream();
  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) = delete;

  /// Fills `bytes`, or throws Error(badInput) saying where the data ended.
  void read(std::span<std::byte> bytes);
  /// Reads up to bytes.size() and returns how many there were.
  std::size_t readSome(std::span<std::byte> bytes);
  void skip(std::uint64_t count);
  /// True when nothing is left; on gzip this also verifies the checksum of what was read.
  bool atEnd();

  bool compressed() const;
  /// Bytes read or skipped so far, after decompression.
  std::uint64_t position() const;
  /// Upper bound of position(): the file's size, or what deflate can make of it at most (1032 to 1).
  std::uint64_t largestSize() const;
  const std::filesystem::path& path() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scolopax::io
