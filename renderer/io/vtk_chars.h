// SPDX-License-Identifier: Apache-2.0
// The characters of a part of a VTK file, through a buffer: markup, words of numbers, base64 and raw bytes.
// Between ByteStream and vtk_array.h, vtk_markup.h and vtk_legacy.cpp.
#pragma once
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/byte_stream.h"

namespace scolopax::io {

class VtkChars {
 public:
  static constexpr std::uint64_t kToTheEnd = std::numeric_limits<std::uint64_t>::max();

  /// The bytes from `begin` to `end` of the file, or fewer if it ends there; with `detect`, of what a gzip
  /// file contains. Throws like ByteStream.
  explicit VtkChars(const std::filesystem::path& path, std::uint64_t begin = 0, std::uint64_t end = kToTheEnd,
                    ByteStream::Encoding encoding = ByteStream::Encoding::plain);

  /// The next one, 0 to 255; -1 at the end.
  int get() { return at_ < size_ || fill() ? static_cast<unsigned char>(buffer_[at_++]) : -1; }
  int peek() { return at_ < size_ || fill() ? static_cast<unsigned char>(buffer_[at_]) : -1; }
  /// All that is in the buffer, at least one character unless at the end. take() says how many are done with.
  std::string_view buffered();
  void take(std::size_t count) { at_ += count; }

  /// Reads up to bytes.size() bytes and returns how many; fewer only at the end.
  std::size_t readSome(std::span<std::byte> bytes);
  /// Returns false if there are fewer.
  bool skip(std::uint64_t count);

  /// The word behind the blanks that are next; "" at the end. Longer ones come in pieces of 1024 characters.
  /// Valid until the next call.
  std::string_view word();
  /// The rest of the line, without its end. Of lines beyond 64 KiB the beginning.
  std::string line();

  /// In the file, or for gzip in what it contains.
  std::uint64_t position() const { return begin_ + stream_.position() - (size_ - at_); }
  /// Upper bound of the bytes that follow.
  std::uint64_t left() const;

 private:
  bool fill();

  std::uint64_t begin_, limit_;  ///< limit_: bytes of the stream that may be read
  ByteStream stream_;
  std::vector<char> buffer_;
  std::size_t at_ = 0, size_ = 0;
  std::string word_;
};

inline bool isVtkBlank(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace scolopax::io
