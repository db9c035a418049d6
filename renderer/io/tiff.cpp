// SPDX-License-Identifier: Apache-2.0
// TIFF stacks, one page per slice, and ImageJ's hyperstacks (pages in the order channel, z, time), decoded by
// OpenImageIO.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/tiff_decode.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// How the pages make up the volume.
struct Stack {
  std::int64_t channels = 1, slices = 1, times = 1;
  glm::dvec3 spacing{1};
  std::string unit;         ///< of the spacing; "" if unknown
  double timeInterval = 0;  ///< seconds; 0 if unknown
  std::int64_t pages() const { return channels * slices * times; }
};

/// The lines "key=value" of ImageJ's ImageDescription; none if it is not ImageJ's.
std::optional<std::map<std::string, std::string>> imageJFields(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  std::map<std::string, std::string> fields;
  while (!description.empty()) {
    const std::string_view line = description.substr(0, description.find('\n'));
    description.remove_prefix(std::min(description.size(), line.size() + 1));
    const auto equals = line.find('=');
    if (equals == std::string_view::npos) continue;
    fields.emplace(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
  }
  return fields;
}

/// ImageJ's name of a unit of length, as it is shown; "pixel" is none.
std::string lengthUnit(const std::string& name) {
  if (name == "micron" || name == "microns" || name == "\\u00B5m" || name == "\xC2\xB5m" || name == "um")
    return "um";
  return name == "pixel" || name == "pixels" ? "" : name;
}

Stack describeStack(const std::string& file, const OIIO::ImageSpec& spec, std::int64_t pageCount) {
  const std::string description = spec.get_string_attribute("ImageDescription");
  Stack stack;
  const auto fields = imageJFields(description);
  if (!fields) {
    stack.slices = pageCount;
    return stack;
  }
  const auto count = [&](const char* key, std::int64_t otherwise) {
    const auto field = fields->find(key);
    if (field == fields->end()) return otherwise;
    const auto value = parseInteger(field->second);
    if (!value || *value < 1 || *value > 1'000'000'000) {
      throw Error(ErrorCode::badInput, file + ": ImageDescription: " + key + ": expected 1 or more, found " +
                                           inQuotes(field->second));
    }
    return *value;
  };
  const std::int64_t images = count("images", pageCount);
  stack.channels = count("channels", 1);
  stack.times = count("frames", 1);
  const std::uint64_t rest = saturatingProduct(std::uint64_t(stack.channels), std::uint64_t(stack.times));
  stack.slices = count(
      "slices", std::max<std::int64_t>(1, images / std::int64_t(std::min<std::uint64_t>(rest, 1u << 30))));
  const std::uint64_t told = saturatingProduct(rest, std::uint64_t(stack.slices));
  // A single page for all images: ImageJ's way beyond 4 GB, where the other images follow the first.
  if (told != std::uint64_t(images) || (images != pageCount && pageCount != 1)) {
    throw Error(ErrorCode::badInput,
                file + ": ImageDescription: expected channels x slices x frames = images = pages, found " +
                    std::to_string(stack.channels) + " x " + std::to_string(stack.slices) + " x " +
                    std::to_string(stack.times) + ", " + std::to_string(images) + ", " +
                    std::to_string(pageCount));
  }
  const auto length = [](double value) { return std::isfinite(value) && value > 0 ? value : 1.0; };
  stack.spacing.x = length(1.0 / double(spec.get_float_attribute("XResolution")));
  stack.spacing.y = length(1.0 / double(spec.get_float_attribute("YResolution")));
  if (const auto spacing = fields->find("spacing"); spacing != fields->end()) {
    stack.spacing.z = length(std::abs(parseNumber(spacing->second).value_or(0)));
  }
  if (const auto unit = fields->find("unit"); unit != fields->end()) stack.unit = lengthUnit(unit->second);
  if (const auto interval = fields->find("finterval"); interval != fields->end())
    stack.timeInterval = parseNumber(interval->second).value_or(0);
  return stack;
}

/// Reads the pages in order, each into `page`: `samples` interleaved numbers per pixel, in host byte order.
class PageReader {
 public:
  PageReader(const fs::path& path, TiffPages& pages, const OIIO::ImageSpec& first, StoredType type,
             bool contiguous)
      : file_(shown(path)), pages_(pages), first_(first), type_(type) {
    if (contiguous) behind_.emplace(path, ByteStream::Encoding::plain, pages.stripOffset(0));
  }

  void read(std::size_t index, std::vector<std::byte>& page) {
    if (behind_) {
      behind_->skip(index * page.size() - behind_->position());
      behind_->read(page);
      if (pages_.bigEndian()) {
        const std::size_t size = sizeBytes(type_);
        for (auto at = page.begin(); at != page.end(); at += std::ptrdiff_t(size))
          std::reverse(at, at + std::ptrdiff_t(size));
      }
      return;
    }
    const auto input = openTiffPage(pages_, index);
    const OIIO::ImageSpec& spec = input->spec();
    const std::string where = file_ + ": page " + std::to_string(index + 1);
    const auto text = [](const OIIO::ImageSpec& s) {
      return std::to_string(s.width) + "x" + std::to_string(s.height) + ", " + std::to_string(s.nchannels) +
             " x " + s.format.c_str();
    };
    if (text(spec) != text(first_) || spec.depth > 1) {
      throw Error(ErrorCode::unsupported,
                  where + ": expected " + text(first_) + " as on page 1, found " + text(spec));
    }
    input->geterror();  // discards what opening recorded: only warnings
    if (!readTiffPixels(*input, page) || input->has_error()) {
      throw Error(ErrorCode::badInput, where + ": cannot be decoded: " + cleanText(input->geterror()));
    }
  }

 private:
  std::string file_;
  TiffPages& pages_;
  const OIIO::ImageSpec& first_;
  StoredType type_;
  std::optional<ByteStream> behind_;
};

/// Layout of all samples of a stack at one time.
VoxelLayout layoutOf(const std::string& file, const OIIO::ImageSpec& first, const Stack& stack) {
  constexpr std::int64_t kMostTiffChannels = 4096;
  VoxelLayout layout;
  layout.type = tiffStoredType(file, first);
  layout.dims =
      checkedDims(file + ": ImageWidth, ImageLength, pages", first.width, first.height, stack.slices);
  const std::int64_t samples = first.nchannels;
  if (samples < 1 || samples > kMostTiffChannels || stack.channels > kMostTiffChannels / samples) {
    throw Error(ErrorCode::unsupported, file + ": expected at most " + std::to_string(kMostTiffChannels) +
                                            " channels, found " + std::to_string(stack.channels) + " of " +
                                            std::to_string(samples) + " samples");
  }
  layout.samples = std::size_t(stack.channels * samples);
  return layout;
}

void checkFileSize(const std::string& file, const TiffPages& pages, const OIIO::ImageSpec& first,
                   const VoxelLayout& layout, const Stack& stack) {
  const std::uint64_t holds = saturatingProduct(pages.fileSize(), tiffExpansion(first));
  const std::uint64_t needed = saturatingProduct(layout.sizeBytes(), std::uint64_t(stack.times));
  if (needed > holds) {
    throw Error(ErrorCode::badInput, file + ": " + layout.description() + " needs " + std::to_string(needed) +
                                         " bytes, the file holds at most " + std::to_string(holds));
  }
}

/// Whether the other images follow the first one without pages of their own. Throws Error(badInput) if they
/// cannot.
bool isContiguous(const std::string& file, const TiffPages& pages, const OIIO::ImageSpec& first,
                  const Stack& stack) {
  const bool contiguous = std::int64_t(pages.pageCount()) < stack.pages();
  if (contiguous && (tiffExpansion(first) != 1 || first.tile_width != 0 || pages.stripOffset(0) == 0)) {
    throw Error(ErrorCode::badInput,
                file + ": ImageDescription: expected a page for each image of a compressed file, found one");
  }
  return contiguous;
}

/// What the headers of a stack say.
struct OpenStack {
  std::string file;  ///< for messages
  OIIO::ImageSpec first;
  Stack stack;
  VoxelLayout layout;
  bool contiguous = false;
};

OpenStack openStack(const fs::path& path, TiffPages& pages) {
  OpenStack open{shown(path), openTiffPage(pages, 0)->spec(), {}, {}};
  open.stack = describeStack(open.file, open.first, std::int64_t(pages.pageCount()));
  open.layout = layoutOf(open.file, open.first, open.stack);
  checkFileSize(open.file, pages, open.first, open.layout, open.stack);
  open.contiguous = isContiguous(open.file, pages, open.first, open.stack);
  return open;
}

/// The samples that are channels: all but alpha.
std::vector<std::size_t> channelSamples(const OpenStack& open) {
  std::vector<std::size_t> samples;
  for (int i = 0; i < int(open.layout.samples); ++i)
    if (open.first.alpha_channel < 0 || i % open.first.nchannels != open.first.alpha_channel)
      samples.push_back(std::size_t(i));
  return samples;
}

std::vector<ChannelInfo> tiffChannels(const OpenStack& open, const std::string& stem) {
  const bool rgb = open.stack.channels == 1 && open.first.nchannels >= 3 && open.first.channelnames[0] == "R";
  static constexpr std::array kColors{"red", "green", "blue"};
  std::vector<ChannelInfo> channels;
  for (const std::size_t sample : channelSamples(open)) {
    ChannelInfo channel{.type = open.layout.type};
    if (open.layout.samples > 1)
      channel.name = stem + " " + (rgb && sample < 3 ? kColors[sample] : std::to_string(sample));
    channels.push_back(channel);
  }
  return channels;
}

Times tiffTimes(const Stack& stack) {
  Times times{.count = std::size_t(stack.times)};
  if (!(stack.timeInterval > 0) || !std::isfinite(stack.timeInterval) || times.count == 1) return times;
  for (std::size_t i = 0; i < times.count; ++i) times.values.push_back(double(i) * stack.timeInterval);
  times.unit = "s";
  return times;
}

/// Reads the pages of one time that the part's channels need.
std::vector<VoxelBuffer> readTiff(const fs::path& path, const VolumeInfo& volume, const Part& part,
                                  Loading& loading) {
  TiffPages pages(path);
  const OpenStack open = openStack(path, pages);
  const std::vector<std::size_t> channels = channelSamples(open);
  if (open.layout.dims != volume.levels[0].dims || open.layout.type != volume.channels[0].type ||
      channels.size() != volume.channels.size() || std::size_t(open.stack.times) != volume.times.count)
    throw Error(ErrorCode::badInput, open.file + ": expected the same pages as before, found others");

  PageReader reader(path, pages, open.first, open.layout.type, open.contiguous);
  auto writers = makeWriters(open.file, volume, part, loading);
  const std::size_t numberBytes = sizeBytes(open.layout.type), samples = std::size_t(open.first.nchannels),
                    pixels = std::size_t(open.first.width) * std::size_t(open.first.height),
                    perSlice = std::size_t(open.stack.channels), slices = std::size_t(open.stack.slices);
  loading.checkMemory(open.file + ": a page", pixels * samples * numberBytes);
  std::vector<std::byte> page(pixels * samples * numberBytes);
  for (std::size_t slice = 0; slice < slices; ++slice) {
    for (std::size_t c = 0; c < perSlice; ++c) {
      const auto isOnPage = [&](std::size_t channel) { return channels[channel] / samples == c; };
      if (std::ranges::none_of(part.channels, isOnPage)) continue;
      reader.read((part.time * slices + slice) * perSlice + c, page);
      for (std::size_t i = 0; i < part.channels.size(); ++i) {
        if (!isOnPage(part.channels[i])) continue;
        writers[i].writeStrided(slice * pixels, pixels,
                                page.data() + channels[part.channels[i]] % samples * numberBytes,
                                std::ptrdiff_t(samples * numberBytes));
      }
    }
  }
  return takeAll(writers);
}

}  // namespace

Match matchTiff(const FileStart& start) {
  using namespace std::string_view_literals;
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (start.bytes.starts_with(magic)) return Match::content;
  const bool named = start.hasEnding(".tif") || start.hasEnding(".tiff");
  return named && !start.folder ? Match::name : Match::no;
}

VolumeFile openTiff(const fs::path& path, const OpenOptions& options) {
  TiffPages pages(path);
  const OpenStack open = openStack(path, pages);
  Grid grid{open.layout.dims};
  for (int axis = 0; axis < 3; ++axis) grid.worldFromVoxel[axis][axis] = open.stack.spacing[axis];
  VolumeFile file{path};
  file.volumes = {{.levels = {grid},
                   .times = tiffTimes(open.stack),
                   .channels = tiffChannels(open, stemOf(path)),
                   .worldUnit = open.stack.unit}};
  const std::size_t channels = file.volumes[0].channels.size();
  if (channels == 0)
    throw Error(ErrorCode::unsupported, open.file + ": expected a channel beside alpha, found none");
  if (channels < open.layout.samples) options.warn(open.file + ": alpha is left out");
  if (pages.hasPalette(0)) options.warn(open.file + ": the indices are loaded, the palette is left out");
  file.read = [path](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readTiff(path, volume, part, loading);
  };
  return file;
}

}  // namespace scolopax::io
