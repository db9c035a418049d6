// SPDX-License-Identifier: Apache-2.0
// Which page of which file holds a plane of an OME image. Between the OME-XML and the reader of OME-TIFF.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "renderer/io/ome_xml.h"

namespace scolopax::io {

/// The files that an OME-XML names.
class OmeFiles {
 public:
  /// `holder` has the XML, and is a TIFF or a companion file of TIFFs.
  OmeFiles(std::filesystem::path holder, bool holderIsTiff, const OmeDocument& document);

  /// Index of the file that the element names. Throws Error: notFound if there is none, badInput if it does
  /// not lie in or below the holder's folder, or if a companion file names none.
  std::size_t indexOf(const OmeTiffData& data);
  /// Number of its pages. Throws what TiffPages does.
  std::uint64_t pageCount(std::size_t file);

  const std::vector<std::filesystem::path>& paths() const { return paths_; }
  const std::filesystem::path& holder() const { return holder_; }

 private:
  std::size_t add(const std::filesystem::path& path);
  bool isHolder(const OmeTiffData& data) const;

  std::filesystem::path holder_;
  bool holderIsTiff_;
  std::string uuid_;   ///< of the holder
  bool severalNames_;  ///< whether the document names more than one file
  std::vector<std::filesystem::path> paths_;
  std::vector<std::optional<std::uint64_t>> pageCounts_;
  std::map<std::string, std::size_t> known_;  ///< index by the name in the document; "" is the holder
};

struct OmePlane {
  std::size_t file = 0, page = 0;  ///< indices
};

/// The planes that a file has of an image.
struct OmePlanes {
  std::int64_t slices = 1, channels = 1, times = 1;
  std::map<std::int64_t, OmePlane> found;  ///< by indexOf

  std::int64_t count() const { return slices * channels * times; }
  std::int64_t indexOf(std::int64_t slice, std::int64_t channel, std::int64_t time) const {
    return (time * channels + channel) * slices + slice;
  }
};

/// `samples`: channels of the image in each plane, a divisor of sizeC. `where` begins errors. Throws
/// Error(badInput) if the elements name planes or pages that there are not.
OmePlanes mapOmePlanes(const std::string& where, const OmeImage& image, std::int64_t samples,
                       OmeFiles& files);

}  // namespace scolopax::io
