// SPDX-License-Identifier: Apache-2.0
// The chain of a TIFF's pages, walked once, and a view of the file in which any one page is the only one:
// OpenImageIO finds page n by walking the chain from the start, which is quadratic over a stack.
#pragma once
#include <OpenImageIO/filesystem.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace scolopax::io {

class TiffPages : public OIIO::Filesystem::IOProxy {
 public:
  /// Walks the chain: classic or BigTIFF, either byte order. Throws Error(badInput) for a file that is not
  /// TIFF, and for a chain that loops or leaves the file.
  /// Stops after `mostPages`.
  explicit TiffPages(const std::filesystem::path& path, std::size_t mostPages = SIZE_MAX);
  ~TiffPages() override;
  TiffPages(const TiffPages&) = delete;
  TiffPages& operator=(const TiffPages&) = delete;

  std::size_t pageCount() const { return pages_.size(); }
  bool bigEndian() const { return bigEndian_; }
  std::uint64_t fileSize() const { return fileSize_; }
  /// Where the page's first strip is; 0 when it has none.
  std::uint64_t stripOffset(std::size_t page) const { return pages_[page].strip; }
  bool hasPalette(std::size_t page) const { return pages_[page].photometric == 3; }
  /// The page's ImageDescription; "" if it has none.
  std::string description(std::size_t page) const;
  /// Resolutions of the page: itself, and those of its SubIFDs, as OME-TIFF stores pyramids. At least 1.
  std::size_t levelCount(std::size_t page) const { return 1 + pages_[page].subDirectories.size(); }
  /// Makes one resolution of `page` the only page. Its numbers come out as they are stored: a palette or an
  /// inverted grey scale, which are for display, are not applied. Throws Error(badInput) if the SubIFD does
  /// not lie in the file.
  void select(std::size_t page, std::size_t level = 0);

  const char* proxytype() const override { return "scolopax-tiff-page"; }
  std::size_t read(void* buffer, std::size_t size) override;
  std::size_t pread(void* buffer, std::size_t size, std::int64_t offset) override;
  std::size_t size() const override { return std::size_t(fileSize_); }

 private:
  struct Page {
    std::uint64_t start = 0;  ///< of its directory
    std::uint64_t next = 0;   ///< position of the next page's offset
    std::uint64_t strip = 0;
    std::uint64_t photometricAt = 0;  ///< position of the value; 0 if the tag is absent
    unsigned photometric = 1;
    std::uint64_t descriptionAt = 0, descriptionBytes = 0;
    std::vector<std::uint64_t> subDirectories;
  };
  /// Bytes that reads return in place of the file's.
  struct Patch {
    std::uint64_t at = 0;
    std::size_t size = 0;
    std::array<unsigned char, 8> bytes{};
  };
  Page readPage(std::uint64_t start, std::uint64_t& directoryBytes) const;
  void readSubDirectories(std::uint64_t at, std::uint64_t count, std::size_t valueBytes, Page& page) const;
  std::uint64_t number(std::uint64_t at, std::size_t size) const;
  Patch patch(std::uint64_t at, std::size_t size, std::uint64_t value) const;

  int fd_ = -1;
  std::uint64_t fileSize_ = 0;
  bool bigEndian_ = false, bigTiff_ = false;
  std::vector<Page> pages_;
  std::vector<Patch> patches_;
};

}  // namespace scolopax::io
