// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ome_series.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMostOmeChannels = 4096;

/// The type that the XML states: programs leave the signs out of the pages. Warns if it is not the pages'.
StoredType omeType(const std::string& where, const OmeImage& image, StoredType pages, const Warn& warn) {
  if (image.type == "bit" || image.type.find("complex") != std::string::npos)
    throw Error(ErrorCode::unsupported,
                where + ": Pixels: Type: expected integers or floats, found " + inQuotes(image.type));
  const auto stated = storedTypeFromName(image.type == "float"    ? "float32"
                                         : image.type == "double" ? "float64"
                                                                  : image.type);
  if (!stated || *stated == pages) return pages;
  const bool sameSize = sizeBytes(*stated) == sizeBytes(pages);
  warn(where + ": Pixels: Type: expected " + std::string(nameOf(pages)) + " as on the pages, found " +
       inQuotes(image.type) + "; read as " + std::string(nameOf(sameSize ? *stated : pages)));
  return sameSize ? *stated : pages;
}

/// The affine of the finest level. An axis without a spacing gets that of another one.
glm::dmat4 omeWorldFromVoxel(const std::string& where, const OmeImage& image, const Warn& warn) {
  double otherwise = 1;
  for (const auto& spacing : image.spacing)
    if (spacing) {
      otherwise = *spacing;
      break;
    }
  glm::dmat4 m(1.0);
  const std::array sizes{image.sizeX, image.sizeY, image.sizeZ};
  for (int axis = 0; axis < 3; ++axis) {
    const auto& spacing = image.spacing[std::size_t(axis)];
    m[axis][axis] = spacing.value_or(otherwise);
    if (!spacing && !image.unit.empty() && sizes[std::size_t(axis)] > 1)
      warn(where + ": Pixels: PhysicalSize" + "XYZ"[axis] + ": is missing, taken as that of another axis");
  }
  return m;
}

/// How many fine voxels make a coarse one along an axis. Programs round sizes up or down: 25 to 12 is by 2.
double omeLevelFactor(int fine, int coarse) {
  const double ratio = double(fine) / coarse, whole = std::round(ratio), size = fine / whole;
  return std::floor(size) == coarse || std::ceil(size) == coarse ? whole : ratio;
}

/// The grids of a page and of its SubIFDs, which have fewer pixels and as many slices.
std::vector<Grid> omeLevels(const std::string& where, TiffPages& pages, std::size_t page,
                            const OIIO::ImageSpec& first, const Grid& finest, const Warn& warn) {
  std::vector<Grid> levels{finest};
  for (std::size_t level = 1; level < pages.levelCount(page); ++level) {
    const OIIO::ImageSpec spec = openTiffPage(pages, page, level)->spec();
    Grid grid = levels.back();  // becomes the next one
    const bool smaller = spec.width <= grid.dims.x && spec.height <= grid.dims.y &&
                         (spec.width < grid.dims.x || spec.height < grid.dims.y);
    if (!smaller || spec.width < 1 || spec.height < 1 || spec.nchannels != first.nchannels ||
        spec.format != first.format) {
      warn(where + ": SubIFDs: expected smaller pictures of " + std::to_string(first.nchannels) + " x " +
           first.format.c_str() + ", found " + omePageText(spec) + "; left out");
      break;
    }
    for (int axis = 0; axis < 2; ++axis) {
      const int size = axis == 0 ? spec.width : spec.height;
      const double factor = omeLevelFactor(grid.dims[axis], size);
      grid.worldFromVoxel[3] += grid.worldFromVoxel[axis] * ((factor - 1) / 2);
      grid.worldFromVoxel[axis] *= factor;
      grid.dims[axis] = size;
    }
    levels.push_back(grid);
  }
  return levels;
}

/// Channels in the order of the planes and the samples in them.
std::vector<ChannelInfo> omeChannels(const OmeImage& image, int samples, const OIIO::ImageSpec& first,
                                     StoredType type) {
  static constexpr std::array kNames{"red", "green", "blue", "alpha"};
  static constexpr std::array<std::array<std::uint8_t, 3>, 3> kColors{
      {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}}};
  const bool rgb = samples >= 3 && first.channelnames[0] == "R";
  std::vector<ChannelInfo> channels;
  for (int i = 0; i < int(image.sizeC); ++i) {
    const int plane = i / samples, sample = i % samples;
    const OmeChannel stated =
        std::size_t(plane) < image.channels.size() ? image.channels[std::size_t(plane)] : OmeChannel{};
    ChannelInfo channel{.name = stated.name, .type = type};
    if (samples > 1) {
      if (!channel.name.empty()) channel.name += " ";
      channel.name += rgb && sample < 4 ? kNames[std::size_t(sample)] : std::to_string(i);
      if (rgb && sample < 3) channel.look.color = kColors[std::size_t(sample)];
    } else {
      channel.look.color = stated.color;
    }
    channels.push_back(channel);
  }
  return channels;
}

/// Maps the planes with the samples that the XML states, and if the pages have others, with theirs.
std::unique_ptr<TiffPages> openOmePlanes(const std::string& where, const OmeImage& image, OmeFiles& files,
                                         OmeSeries& series, OIIO::ImageSpec& first, const Warn& warn) {
  if (image.sizeC > kMostOmeChannels)
    throw Error(ErrorCode::unsupported, where + ": Pixels: SizeC: expected at most " +
                                            std::to_string(kMostOmeChannels) + ", found " +
                                            std::to_string(image.sizeC));
  const std::int64_t stated = image.channels[0].samples;
  std::int64_t samples = image.sizeC % stated == 0 ? stated : 1;
  for (const bool last : {false, true}) {
    series.planes = mapOmePlanes(where, image, samples, files);
    const OmePlane& plane = series.planes.found.begin()->second;
    auto pages = std::make_unique<TiffPages>(files.paths()[plane.file]);
    first = openTiffPage(*pages, plane.page)->spec();
    series.samples = int(samples);
    if (first.nchannels == samples) return pages;
    if (last || first.nchannels < 1 || image.sizeC % first.nchannels != 0) break;
    warn(where + ": Channel: SamplesPerPixel: expected " + std::to_string(first.nchannels) +
         " as on the pages, found " + std::to_string(samples));
    samples = first.nchannels;
  }
  throw Error(ErrorCode::badInput, where + ": Pixels: SizeC, SamplesPerPixel: expected the " +
                                       std::to_string(first.nchannels) + " samples of the pages, found " +
                                       std::to_string(image.sizeC) + ", " + std::to_string(samples));
}

/// Throws Error(badInput) if the files cannot hold the planes.
void checkOmeSize(const std::string& where, const OmeFiles& files, const OmePlanes& planes,
                  const OIIO::ImageSpec& first) {
  std::set<std::size_t> used;
  for (const auto& [index, plane] : planes.found) used.insert(plane.file);
  std::uint64_t bytes = 0;
  for (const std::size_t file : used) {
    std::error_code failed;
    const std::uint64_t size = fs::file_size(files.paths()[file], failed);
    bytes = saturatingSum(bytes, failed ? 0 : size);
  }
  const std::uint64_t holds = saturatingProduct(bytes, tiffExpansion(first)),
                      needed = saturatingProduct(first.image_bytes(true), planes.found.size());
  if (needed > holds)
    throw Error(ErrorCode::badInput, where + ": " + std::to_string(planes.found.size()) + " planes of " +
                                         omePageText(first) + " need " + byteCount(needed) +
                                         ", the files hold at most " + byteCount(holds));
}

}  // namespace

std::string omePageText(const OIIO::ImageSpec& spec) {
  return std::to_string(spec.width) + "x" + std::to_string(spec.height) + ", " +
         std::to_string(spec.nchannels) + " x " + spec.format.c_str();
}

VolumeInfo openOmeImage(const std::string& where, const OmeImage& image, OmeFiles& files, OmeSeries& series,
                        const Warn& warn) {
  OIIO::ImageSpec first;
  const auto pages = openOmePlanes(where, image, files, series, first, warn);
  if (first.width != image.sizeX || first.height != image.sizeY || first.depth > 1)
    throw Error(ErrorCode::badInput, where + ": Pixels: SizeX, SizeY: expected " +
                                         std::to_string(first.width) + ", " + std::to_string(first.height) +
                                         " as on the pages, found " + std::to_string(image.sizeX) + ", " +
                                         std::to_string(image.sizeY));
  const StoredType type = omeType(where, image, tiffStoredType(where, first), warn);
  series.numbers = first.format;
  Grid finest{checkedDims(where + ": Pixels: SizeX, SizeY, SizeZ", image.sizeX, image.sizeY, image.sizeZ),
              omeWorldFromVoxel(where, image, warn)};
  checkOmeSize(where, files, series.planes, first);
  VolumeInfo volume{.times = image.times, .worldUnit = image.unit};
  volume.levels = omeLevels(where, *pages, series.planes.found.begin()->second.page, first, finest, warn);
  volume.channels = omeChannels(image, series.samples, first, type);
  const std::int64_t found = std::int64_t(series.planes.found.size()), all = series.planes.count();
  if (found < all)
    warn(where + ": TiffData: expected " + std::to_string(all) + " planes, found " + std::to_string(found) +
         "; the others are 0");
  return volume;
}

}  // namespace scolopax::io
