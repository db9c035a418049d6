// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/byte_stream.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// Deflate expands 2 bits to at most 258 bytes.
constexpr std::uint64_t kDeflateRatio = 1032;

/// Opens a regular file; returns its descriptor and size. O_NONBLOCK, as opening a pipe without a writer must
/// not hang.
std::pair<int, std::uint64_t> openRegular(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) {
    const int reason = errno;
    const bool absent = reason == ENOENT || reason == ENOTDIR;
    throw Error(absent ? ErrorCode::notFound : ErrorCode::io,
                shown(path) + ": " + (absent ? "no such file" : std::strerror(reason)));
  }
  struct stat status {};
  const bool known = ::fstat(fd, &status) == 0;
  if (!known || !S_ISREG(status.st_mode)) {
    ::close(fd);
    const char* what = !known                     ? "something unknown"
                       : S_ISDIR(status.st_mode)  ? "a folder"
                       : S_ISFIFO(status.st_mode) ? "a pipe"
                                                  : "a device or socket";
    throw Error(ErrorCode::badInput, shown(path) + ": expected a regular file, found " + what);
  }
  return {fd, std::uint64_t(status.st_size)};
}

}  // namespace

void requireRegularFile(const fs::path& path) { ::close(openRegular(path).first); }

fs::path resolveDataFile(const fs::path& header, std::string_view field, std::string_view name,
                         std::string_view packedEnding) {
  const auto refuse = [&](ErrorCode code, const std::string& what) {
    return Error(code, shown(header) + ": " + std::string(field) + ": " + what);
  };
  const auto outside = [&] {
    return refuse(ErrorCode::badInput,
                  "expected a file in or below the header's folder, found " + inQuotes(name));
  };
  const fs::path relative{std::string(name)};
  if (name.empty() || name.find('\0') != std::string_view::npos || relative.is_absolute()) throw outside();
  if (std::ranges::find(relative, fs::path("..")) != relative.end()) throw outside();

  const fs::path folder = header.has_parent_path() ? header.parent_path() : fs::path(".");
  std::error_code error;
  const fs::path realFolder = fs::weakly_canonical(fs::absolute(folder), error);
  const fs::path realFile = error ? fs::path() : fs::weakly_canonical(realFolder / relative, error);
  if (error) throw refuse(ErrorCode::io, "cannot resolve " + inQuotes(name) + ": " + error.message());
  const auto [folderEnd, fileEnd] = std::ranges::mismatch(realFolder, realFile);
  if (folderEnd != realFolder.end()) throw outside();
  if (!fs::exists(realFile, error)) {
    if (!packedEnding.empty()) {
      const std::string packed = std::string(name) + std::string(packedEnding);
      if (fs::exists(realFolder / packed, error)) return resolveDataFile(header, field, packed);
    }
    throw refuse(ErrorCode::notFound, "names " + inQuotes(name) + ", which is not in " + shown(folder));
  }
  return folder / relative;
}

struct ByteStream::State {
  fs::path path;
  int fd = -1;            ///< plain files; not read by zlib, which would unpack what only looks like gzip
  gzFile file = nullptr;  ///< gzip; owns its own descriptor
  std::uint64_t position = 0;
  std::uint64_t largestSize = 0;

  ~State() {
    if (file) ::gzclose(file);
    if (fd >= 0) ::close(fd);
  }
};

ByteStream::ByteStream(const fs::path& path, Encoding encoding, std::uint64_t offset)
    : state_(std::make_unique<State>()) {
  const auto [fd, fileSize] = openRegular(path);
  state_->path = path;
  state_->fd = fd;
  const std::uint64_t left = fileSize - std::min(offset, fileSize);
  state_->largestSize = left;
  if (left > 0 && ::lseek(fd, off_t(offset), SEEK_SET) < 0) {
    throw Error(ErrorCode::io, shown(path) + ": cannot seek to byte " + std::to_string(offset));
  }
  if (encoding == Encoding::plain) return;

  std::array<unsigned char, 2> magic{};
  const bool startsLikeGzip =
      left > 2 && ::pread(fd, magic.data(), 2, off_t(offset)) == 2 && magic[0] == 0x1F && magic[1] == 0x8B;
  if (!startsLikeGzip) {
    if (encoding == Encoding::detect) return;
    throw Error(ErrorCode::badInput, shown(path) + ": expected gzip data at byte " + std::to_string(offset) +
                                         ", found something else");
  }
  state_->file = ::gzdopen(fd, "rb");
  if (!state_->file) throw Error(ErrorCode::io, shown(path) + ": cannot be read");
  state_->fd = -1;
  state_->largestSize = left * kDeflateRatio;
  ::gzbuffer(state_->file, 1u << 17);
}

ByteStream::~ByteStream() = default;
ByteStream::ByteStream(ByteStream&&) noexcept = default;

std::size_t ByteStream::readSome(std::span<std::byte> bytes) {
  constexpr std::size_t kLargestRead = std::size_t(1) << 30;  // gzread counts in int
  std::size_t done = 0;
  while (done < bytes.size()) {
    const std::size_t want = std::min(bytes.size() - done, kLargestRead);
    const auto got = state_->file ? ssize_t(::gzread(state_->file, bytes.data() + done, unsigned(want)))
                                  : ::read(state_->fd, bytes.data() + done, want);
    if (got < 0) {
      int error = Z_ERRNO;
      if (state_->file) ::gzerror(state_->file, &error);
      const std::string where = " after byte " + std::to_string(state_->position);
      if (error == Z_DATA_ERROR) {
        throw Error(ErrorCode::badInput, shown(state_->path) + ": the gzip data are damaged" + where);
      }
      throw Error(ErrorCode::io, shown(state_->path) + ": cannot be read" + where);
    }
    if (got == 0) break;
    done += std::size_t(got);
    state_->position += std::uint64_t(got);
  }
  return done;
}

void ByteStream::read(std::span<std::byte> bytes) {
  const std::uint64_t start = state_->position;
  const std::size_t got = readSome(bytes);
  if (got == bytes.size()) return;
  throw Error(ErrorCode::badInput, shown(state_->path) + ": expected " + std::to_string(bytes.size()) +
                                       " bytes at byte " + std::to_string(start) +
                                       (compressed() ? " of the unpacked data" : "") + ", found " +
                                       std::to_string(got));
}

void ByteStream::skip(std::uint64_t count) {
  const bool within =
      state_->position <= state_->largestSize && count <= state_->largestSize - state_->position;
  if (!state_->file && within && ::lseek(state_->fd, off_t(count), SEEK_CUR) >= 0) {
    state_->position += count;
    return;
  }
  std::array<std::byte, 1 << 16> scratch;
  while (count > 0) {
    const auto piece = std::size_t(std::min<std::uint64_t>(count, scratch.size()));
    read(std::span(scratch).first(piece));
    count -= piece;
  }
}

bool ByteStream::atEnd() {
  std::byte one;
  if (readSome({&one, 1}) != 0) return false;
  int error = Z_OK;
  if (state_->file) ::gzerror(state_->file, &error);
  if (error == Z_BUF_ERROR) {
    throw Error(ErrorCode::badInput, shown(state_->path) + ": the gzip data end early");
  }
  return true;
}

bool ByteStream::compressed() const { return state_->file != nullptr; }
std::uint64_t ByteStream::position() const { return state_->position; }
std::uint64_t ByteStream::largestSize() const { return state_->largestSize; }
const fs::path& ByteStream::path() const { return state_->path; }

}  // namespace scolopax::io
