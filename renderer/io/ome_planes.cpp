// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ome_planes.h"

#include <algorithm>
#include <array>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"
#include "renderer/io/tiff_pages.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMostOmePlanes = std::int64_t(1) << 40;
constexpr std::uint64_t kMostOmePages = std::uint64_t(1) << 22;  // which bounds time and memory

bool namesSeveralFiles(const OmeDocument& document) {
  std::set<std::string> names;
  for (const OmeImage& image : document.images)
    for (const OmeTiffData& data : image.data) names.insert(data.fileName);
  return names.size() > 1;
}

/// The plane `steps` after another in the order of the image, as an index of OmePlanes; none beyond the last.
std::optional<std::int64_t> omePlaneAfter(const OmePlanes& planes, const OmeImage& image,
                                          const OmeTiffData& data, std::int64_t steps) {
  std::array<std::int64_t, 3> at{};
  std::int64_t position = 0, stride = 1;
  const auto axisOf = [](char letter) { return letter == 'Z' ? 0u : letter == 'C' ? 1u : 2u; };
  const std::array sizes{planes.slices, planes.channels, planes.times};
  const std::array first{data.firstZ, data.firstC, data.firstT};
  for (const char letter : image.order.substr(2)) {
    position += first[axisOf(letter)] * stride;
    stride *= sizes[axisOf(letter)];
  }
  position += steps;
  if (position >= planes.count()) return std::nullopt;
  for (const char letter : image.order.substr(2)) {
    at[axisOf(letter)] = position % sizes[axisOf(letter)];
    position /= sizes[axisOf(letter)];
  }
  return planes.indexOf(at[0], at[1], at[2]);
}

}  // namespace

OmeFiles::OmeFiles(fs::path holder, bool holderIsTiff, const OmeDocument& document)
    : holder_(std::move(holder)),
      holderIsTiff_(holderIsTiff),
      uuid_(document.uuid),
      severalNames_(namesSeveralFiles(document)) {}

std::size_t OmeFiles::add(const fs::path& path) {
  paths_.push_back(path);
  pageCounts_.emplace_back();
  return paths_.size() - 1;
}

bool OmeFiles::isHolder(const OmeTiffData& data) const {
  if (!holderIsTiff_) return false;
  if (data.fileName.empty() || data.fileName == holder_.filename().string()) return true;
  if (!uuid_.empty() && data.uuid == uuid_) return true;  // a file that was renamed
  std::error_code ignored;
  return !severalNames_ && !fs::exists(holder_.parent_path() / data.fileName, ignored);  // also renamed
}

std::size_t OmeFiles::indexOf(const OmeTiffData& data) {
  const bool own = isHolder(data);
  const std::string name = own ? "" : data.fileName;
  if (const auto known = known_.find(name); known != known_.end()) return known->second;
  if (!own && name.empty())
    throw Error(ErrorCode::badInput,
                shown(holder_) + ": TiffData: UUID: expected the FileName of a TIFF, found none");
  const std::size_t index = add(own ? holder_ : resolveDataFile(holder_, "TiffData: FileName", name));
  known_[name] = index;
  return index;
}

std::uint64_t OmeFiles::pageCount(std::size_t file) {
  if (!pageCounts_[file]) pageCounts_[file] = TiffPages(paths_[file]).pageCount();
  return *pageCounts_[file];
}

OmePlanes mapOmePlanes(const std::string& where, const OmeImage& image, std::int64_t samples,
                       OmeFiles& files) {
  OmePlanes planes{image.sizeZ, image.sizeC / samples, image.sizeT, {}};
  const auto bad = [&](const std::string& what) {
    return Error(ErrorCode::badInput, where + ": TiffData: " + what);
  };
  if (saturatingProduct(saturatingProduct(std::uint64_t(planes.slices), std::uint64_t(planes.channels)),
                        std::uint64_t(planes.times)) > std::uint64_t(kMostOmePlanes))
    throw bad("expected at most 2^40 planes, found more");
  static const std::vector<OmeTiffData> kAllPages(1);
  std::uint64_t pages = 0;
  for (const OmeTiffData& data : image.data.empty() ? kAllPages : image.data) {
    if (data.firstZ >= planes.slices || data.firstC >= planes.channels || data.firstT >= planes.times)
      throw bad("FirstZ, FirstC, FirstT: expected a plane of the image, found " +
                std::to_string(data.firstZ) + ", " + std::to_string(data.firstC) + ", " +
                std::to_string(data.firstT));
    const std::size_t file = files.indexOf(data);
    const std::int64_t inFile = std::int64_t(files.pageCount(file)), first = data.page.value_or(0);
    const bool all = !data.page && !data.count;  // as many as there are
    const std::int64_t count = all ? inFile : data.count.value_or(1);
    if (first > inFile - count)
      throw bad("IFD, PlaneCount: expected pages of the " + std::to_string(inFile) + " in " +
                shown(files.paths()[file]) + ", found " + std::to_string(first) + ", " +
                std::to_string(count));
    pages += std::uint64_t(count);
    if (pages > kMostOmePages) throw bad("expected at most 2^22 pages, found more");
    for (std::int64_t i = 0; i < count; ++i) {
      const auto plane = omePlaneAfter(planes, image, data, i);
      if (!plane && all) break;
      if (!plane) throw bad("PlaneCount: expected planes of the image, found " + std::to_string(count));
      planes.found[*plane] = {file, std::size_t(first + i)};
    }
  }
  if (planes.found.empty()) throw bad("expected at least one plane, found none");
  return planes;
}

}  // namespace scolopax::io
