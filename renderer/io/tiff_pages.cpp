// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/tiff_pages.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <unordered_set>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr unsigned kPhotometricTag = 262, kDescriptionTag = 270, kStripOffsetsTag = 273, kSubIfdTag = 330;
constexpr std::size_t kMostSubDirectories = 64;
constexpr unsigned kMinIsWhite = 0, kMinIsBlack = 1, kPalette = 3;

std::uint64_t numberFrom(const unsigned char* bytes, std::size_t size, bool bigEndian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = value << 8 | bytes[bigEndian ? i : size - 1 - i];
  return value;
}

}  // namespace

TiffPages::TiffPages(const std::filesystem::path& path, std::size_t mostPages)
    : IOProxy(path.string(), Read) {
  requireRegularFile(path);
  const auto refuse = [&](const std::string& what) {
    if (fd_ >= 0) ::close(fd_);
    throw Error(ErrorCode::badInput, shown(path) + ": " + what);
  };
  fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  if (fd_ < 0 || ::fstat(fd_, &status) != 0) refuse("cannot be read");
  fileSize_ = std::uint64_t(status.st_size);

  std::array<unsigned char, 4> magic{};
  TiffPages::pread(magic.data(), magic.size(), 0);
  bigEndian_ = magic[0] == 'M';
  const std::uint64_t version = numberFrom(&magic[2], 2, bigEndian_);
  bigTiff_ = version == 43;
  if (magic[0] != magic[1] || (magic[0] != 'M' && magic[0] != 'I') || (version != 42 && version != 43)) {
    refuse("magic: expected a TIFF file, found something else");
  }

  // Directories do not overlap, so together they are no larger than the file: that bounds the walk.
  std::unordered_set<std::uint64_t> seen;
  std::uint64_t directoryBytes = 0;
  for (std::uint64_t at = bigTiff_ ? number(8, 8) : number(4, 4); at != 0 && pages_.size() < mostPages;) {
    const std::string where = "page " + std::to_string(pages_.size() + 1) + ": ";
    if (!seen.insert(at).second) refuse(where + "expected a new directory, found an earlier one");
    const Page page = readPage(at, directoryBytes);
    const std::size_t offsetBytes = bigTiff_ ? 8 : 4;
    if (page.next == 0 || page.next + offsetBytes > fileSize_ || directoryBytes > fileSize_) {
      refuse(where + "expected a directory within the file, found one that ends beyond it");
    }
    pages_.push_back(page);
    at = number(page.next, offsetBytes);
  }
  if (pages_.empty()) refuse("expected at least one page, found none");
}

TiffPages::~TiffPages() { ::close(fd_); }

std::uint64_t TiffPages::number(std::uint64_t at, std::size_t size) const {
  std::array<unsigned char, 8> bytes{};
  if (at > fileSize_ || ::pread(fd_, bytes.data(), size, off_t(at)) != ssize_t(size)) return 0;
  return numberFrom(bytes.data(), size, bigEndian_);
}

TiffPages::Page TiffPages::readPage(std::uint64_t start, std::uint64_t& directoryBytes) const {
  const std::size_t countBytes = bigTiff_ ? 8 : 2, entryBytes = bigTiff_ ? 20 : 12,
                    offsetBytes = bigTiff_ ? 8 : 4;
  Page page;
  page.start = start;
  const std::uint64_t count = start < fileSize_ ? number(start, countBytes) : 0;
  if (count == 0 || count > fileSize_ / entryBytes) return page;  // page.next stays 0: refused
  const std::uint64_t entriesStart = start + countBytes;
  directoryBytes += countBytes + count * entryBytes;
  if (directoryBytes > fileSize_ || entriesStart + count * entryBytes > fileSize_) return page;
  std::vector<unsigned char> entries(std::size_t(count) * entryBytes);
  if (::pread(fd_, entries.data(), entries.size(), off_t(entriesStart)) != ssize_t(entries.size()))
    return page;
  page.next = entriesStart + entries.size();

  for (std::size_t i = 0; i < count; ++i) {
    const unsigned char* entry = &entries[i * entryBytes];
    const auto tag = unsigned(numberFrom(entry, 2, bigEndian_)),
               type = unsigned(numberFrom(entry + 2, 2, bigEndian_));
    const std::size_t valueAt = bigTiff_ ? 12 : 8;
    const std::uint64_t values = numberFrom(entry + 4, offsetBytes, bigEndian_);
    // SHORT; LONG, IFD; LONG8, IFD8
    const std::size_t valueBytes = type == 3                  ? 2
                                   : type == 4 || type == 13  ? 4
                                   : type == 16 || type == 18 ? 8
                                                              : 0;
    const std::uint64_t stored = numberFrom(entry + valueAt, offsetBytes, bigEndian_);
    const auto valuesStart = [&](std::size_t bytesEach) {
      const bool inlined = values <= offsetBytes / bytesEach;
      return inlined ? entriesStart + i * entryBytes + valueAt : stored;
    };
    if (tag == kPhotometricTag && valueBytes == 2) {
      page.photometric = unsigned(numberFrom(entry + valueAt, 2, bigEndian_));
      page.photometricAt = entriesStart + i * entryBytes + valueAt;
    } else if (tag == kStripOffsetsTag && valueBytes > 0) {
      page.strip = number(valuesStart(valueBytes), valueBytes);
    } else if (tag == kDescriptionTag && type == 2) {
      page.descriptionAt = valuesStart(1);
      page.descriptionBytes = values;
    } else if (tag == kSubIfdTag && valueBytes >= 4) {
      readSubDirectories(valuesStart(valueBytes), values, valueBytes, page);
    }
  }
  return page;
}

void TiffPages::readSubDirectories(std::uint64_t at, std::uint64_t count, std::size_t valueBytes,
                                   Page& page) const {
  for (std::uint64_t i = 0; i < count && page.subDirectories.size() < kMostSubDirectories; ++i)
    page.subDirectories.push_back(number(at + i * valueBytes, valueBytes));
}

std::string TiffPages::description(std::size_t index) const {
  const Page& page = pages_[index];
  if (page.descriptionAt >= fileSize_) return {};
  std::string text(std::size_t(std::min(page.descriptionBytes, fileSize_ - page.descriptionAt)), '\0');
  const ssize_t got = ::pread(fd_, text.data(), text.size(), off_t(page.descriptionAt));
  text.resize(std::size_t(std::max<ssize_t>(got, 0)));
  return text.substr(0, text.find('\0'));
}

TiffPages::Patch TiffPages::patch(std::uint64_t at, std::size_t size, std::uint64_t value) const {
  Patch result{at, size, {}};
  for (std::size_t i = 0; i < size; ++i) {
    result.bytes[bigEndian_ ? size - 1 - i : i] = static_cast<unsigned char>(value >> (8 * i));
  }
  return result;
}

void TiffPages::select(std::size_t index, std::size_t level) {
  Page page = pages_[index];
  if (level > 0) {
    std::uint64_t directoryBytes = 0;
    page = readPage(page.subDirectories.at(level - 1), directoryBytes);
    if (page.next == 0)
      throw Error(ErrorCode::badInput, shown(m_filename) + ": page " + std::to_string(index + 1) +
                                           ": SubIFDs: expected directories within the file, found others");
  }
  const std::size_t offsetBytes = bigTiff_ ? 8 : 4;
  patches_ = {patch(bigTiff_ ? 8 : 4, offsetBytes, page.start), patch(page.next, offsetBytes, 0)};
  if (page.photometricAt != 0 && (page.photometric == kMinIsWhite || page.photometric == kPalette)) {
    patches_.push_back(patch(page.photometricAt, 2, kMinIsBlack));
  }
  m_pos = 0;
}

std::size_t TiffPages::read(void* buffer, std::size_t size) {
  const std::size_t got = pread(buffer, size, m_pos);
  m_pos += std::int64_t(got);
  return got;
}

std::size_t TiffPages::pread(void* buffer, std::size_t size, std::int64_t offset) {
  if (offset < 0) return 0;
  auto* bytes = static_cast<unsigned char*>(buffer);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = ::pread(fd_, bytes + done, size - done, off_t(offset) + off_t(done));
    if (got <= 0) break;
    done += std::size_t(got);
  }
  const std::uint64_t begin = std::uint64_t(offset), end = begin + done;
  for (const Patch& p : patches_) {
    for (std::uint64_t at = std::max(begin, p.at); at < std::min(end, p.at + p.size); ++at) {
      bytes[at - begin] = p.bytes[std::size_t(at - p.at)];
    }
  }
  return done;
}

}  // namespace scolopax::io
