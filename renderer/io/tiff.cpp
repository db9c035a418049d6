// SPDX-License-Identifier: Apache-2.0
// TIFF stacks, one page per slice, and ImageJ's hyperstacks (pages in the order channel, z, time), decoded by
// OpenImageIO.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/convert.h"
#include "renderer/io/format.h"
#include "renderer/io/text.h"
#include "renderer/io/tiff_pages.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// How the pages make up the volume.
struct Stack {
  std::int64_t channels = 1, slices = 1, times = 1;
  glm::dvec3 spacing{1};
  std::int64_t pages() const { return channels * slices; }  ///< number to read: the first time step
};

/// Opens one page with OpenImageIO, for its numbers as they are stored.
std::unique_ptr<OIIO::ImageInput> openPage(TiffPages& pages, std::size_t page) {
  pages.select(page);
  OIIO::ImageSpec options, spec;
  options.attribute("oiio:UnassociatedAlpha", 1);
  options.attribute("oiio:RawColor", 1);
  auto input = OIIO::ImageInput::create("tiff");
  if (!input || !input->set_ioproxy(&pages) || !input->open(pages.filename(), spec, options)) {
    throw Error(ErrorCode::badInput, shown(pages.filename()) + ": page " + std::to_string(page + 1) + ": " +
                                         cleanText(input ? input->geterror() : OIIO::geterror()));
  }
  return input;
}

StoredType storedType(const std::string& file, const OIIO::ImageSpec& spec) {
  // OpenImageIO rescales other depths to the next larger type.
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
  if (bits == int(spec.format.size()) * 8) {
    switch (spec.format.basetype) {
      case OIIO::TypeDesc::INT8:
        return StoredType::i8;
      case OIIO::TypeDesc::UINT8:
        return StoredType::u8;
      case OIIO::TypeDesc::INT16:
        return StoredType::i16;
      case OIIO::TypeDesc::UINT16:
        return StoredType::u16;
      case OIIO::TypeDesc::INT32:
        return StoredType::i32;
      case OIIO::TypeDesc::UINT32:
        return StoredType::u32;
      case OIIO::TypeDesc::HALF:
        return StoredType::f16;
      case OIIO::TypeDesc::FLOAT:
        return StoredType::f32;
      case OIIO::TypeDesc::DOUBLE:
        return StoredType::f64;
      default:
        break;
    }
  }
  throw Error(ErrorCode::unsupported,
              file + ": BitsPerSample: expected integers of 8, 16 or 32 bits or floats, found " +
                  std::to_string(bits) + " bits as " + spec.format.c_str());
}

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

Stack describeStack(const std::string& file, const OIIO::ImageSpec& spec, std::int64_t pageCount) {
  const std::string description = spec.get_string_attribute("ImageDescription");
  if (description.find("<OME") != std::string::npos) {
    throw Error(ErrorCode::unsupported,
                file + ": ImageDescription: expected a plain stack or ImageJ's, found OME-XML");
  }
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
  return stack;
}

/// The most bytes that one byte of the file can expand to.
std::uint64_t largestRatio(const OIIO::ImageSpec& spec) {
  const std::string compression = spec.get_string_attribute("compression", "none");
  if (compression == "none") return 1;
  if (compression == "packbits") return 64;
  if (compression == "zip") return 1032;
  return 1 << 15;
}

/// Reads row by row, or tile by tile: when OpenImageIO unpacks several deflated strips or tiles at once, it
/// does not report damage. Returns false on failure.
bool readPixels(OIIO::ImageInput& input, std::vector<std::byte>& page) {
  const OIIO::ImageSpec spec = input.spec();
  const std::size_t pixelBytes = spec.pixel_bytes(true), rowBytes = pixelBytes * std::size_t(spec.width);
  if (spec.tile_width == 0) {
    for (int y = 0; y < spec.height; ++y) {
      if (!input.read_native_scanline(0, 0, spec.y + y, spec.z, &page[std::size_t(y) * rowBytes]))
        return false;
    }
    return true;
  }
  constexpr std::uint64_t kLargestTile = std::uint64_t(1) << 28;
  const std::size_t tileRowBytes = pixelBytes * std::size_t(spec.tile_width);
  if (spec.tile_depth > 1 || saturatingProduct(tileRowBytes, std::uint64_t(spec.tile_height)) > kLargestTile)
    return false;
  std::vector<std::byte> tile(tileRowBytes * std::size_t(spec.tile_height));
  for (int y = 0; y < spec.height; y += spec.tile_height) {
    for (int x = 0; x < spec.width; x += spec.tile_width) {
      if (!input.read_native_tile(0, 0, spec.x + x, spec.y + y, spec.z, tile.data())) return false;
      const std::size_t bytes = pixelBytes * std::size_t(std::min(spec.tile_width, spec.width - x));
      for (int row = 0; row < std::min(spec.tile_height, spec.height - y); ++row) {
        std::memcpy(&page[std::size_t(y + row) * rowBytes + std::size_t(x) * pixelBytes],
                    &tile[std::size_t(row) * tileRowBytes], bytes);
      }
    }
  }
  return true;
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
      behind_->read(page);
      if (pages_.bigEndian()) {
        const std::size_t size = sizeBytes(type_);
        for (auto at = page.begin(); at != page.end(); at += std::ptrdiff_t(size))
          std::reverse(at, at + std::ptrdiff_t(size));
      }
      return;
    }
    const auto input = openPage(pages_, index);
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
    if (!readPixels(*input, page) || input->has_error()) {
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

/// Layout of all samples of a stack.
VoxelLayout layoutOf(const std::string& file, const OIIO::ImageSpec& first, const Stack& stack) {
  VoxelLayout layout;
  layout.type = storedType(file, first);
  layout.dims =
      checkedDims(file + ": ImageWidth, ImageLength, pages", first.width, first.height, stack.slices);
  const std::int64_t samples = first.nchannels;
  if (samples < 1 || samples > kMaxChannels || stack.channels > kMaxChannels / samples) {
    throw Error(ErrorCode::unsupported, file + ": expected at most " + std::to_string(kMaxChannels) +
                                            " channels, found " + std::to_string(stack.channels) + " of " +
                                            std::to_string(samples) + " samples");
  }
  layout.channels = int(stack.channels * samples);
  layout.interleaved = true;  // all channels are read before any is converted
  return layout;
}

void checkFileSize(const std::string& file, const TiffPages& pages, const OIIO::ImageSpec& first,
                   const VoxelLayout& layout) {
  const std::uint64_t holds = saturatingProduct(pages.fileSize(), largestRatio(first));
  if (layout.sizeBytes() > holds) {
    throw Error(ErrorCode::badInput, file + ": " + layout.description() + " needs " +
                                         std::to_string(layout.sizeBytes()) +
                                         " bytes, the file holds at most " + std::to_string(holds));
  }
}

/// Whether the other images follow the first one without pages of their own. Throws Error(badInput) if they
/// cannot.
bool isContiguous(const std::string& file, const TiffPages& pages, const OIIO::ImageSpec& first,
                  const Stack& stack) {
  const bool contiguous = std::int64_t(pages.pageCount()) < stack.pages();
  if (contiguous && (largestRatio(first) != 1 || first.tile_width != 0 || pages.stripOffset(0) == 0)) {
    throw Error(ErrorCode::badInput,
                file + ": ImageDescription: expected a page for each image of a compressed file, found one");
  }
  return contiguous;
}

/// Reads a stack into a buffer for every channel of the layout.
std::vector<VoxelBuffer> readSamples(PageReader& reader, const OIIO::ImageSpec& first, const Stack& stack,
                                     const VoxelLayout& layout) {
  const std::size_t elementBytes = sizeBytes(layout.type),
                    pixels = std::size_t(first.width) * std::size_t(first.height),
                    samples = std::size_t(first.nchannels);
  std::vector<VoxelBuffer> stored;
  stored.reserve(std::size_t(layout.channels));
  for (int c = 0; c < layout.channels; ++c) {
    stored.push_back(makeStoredBuffer(layout.type, std::size_t(layout.voxelCount())));
  }
  std::vector<std::byte> page(pixels * samples * elementBytes);
  for (std::size_t index = 0; index < std::size_t(stack.pages()); ++index) {
    reader.read(index, page);
    const std::size_t z = index / std::size_t(stack.channels), c = index % std::size_t(stack.channels);
    for (std::size_t s = 0; s < samples; ++s) {
      std::byte* to = stored[c * samples + s].data() + z * pixels * elementBytes;
      for (std::size_t i = 0; i < pixels; ++i) {
        std::memcpy(to + i * elementBytes, &page[(i * samples + s) * elementBytes], elementBytes);
      }
    }
  }
  return stored;
}

/// Names the samples and converts their type. Leaves out alpha.
std::vector<ChannelSource> channelsOf(const fs::path& path, const OIIO::ImageSpec& first, const Stack& stack,
                                      const VoxelLayout& layout, std::vector<VoxelBuffer> stored,
                                      const Warn& warn) {
  const std::string stem = stemOf(path);
  const bool rgb = stack.channels == 1 && first.nchannels >= 3 && first.channelnames[0] == "R";
  static constexpr std::array kColors{"red", "green", "blue"};
  std::vector<ChannelSource> channels;
  for (int c = 0; c < layout.channels; ++c) {
    if (first.alpha_channel >= 0 && c % first.nchannels == first.alpha_channel) continue;
    ChannelSource channel;
    channel.voxels =
        toKeptType(layout.type, std::move(stored[std::size_t(c)]), shown(path), c == 0 ? warn : Warn());
    channel.name = layout.channels == 1
                       ? stem
                       : stem + " " + (rgb && c < 3 ? kColors[std::size_t(c)] : std::to_string(c));
    channels.push_back(std::move(channel));
  }
  return channels;
}

}  // namespace

bool matchesTiff(const fs::path& path) { return hasEnding(path, ".tif") || hasEnding(path, ".tiff"); }

LoadedFile loadTiff(const fs::path& path, std::uint64_t memoryLimitBytes, const Warn& warn) {
  const std::string file = shown(path);
  const auto say = [&](const std::string& text) {
    if (warn) warn(file + ": " + text);
  };
  TiffPages pages(path);
  const OIIO::ImageSpec first = openPage(pages, 0)->spec();
  const Stack stack = describeStack(file, first, std::int64_t(pages.pageCount()));
  const VoxelLayout layout = layoutOf(file, first, stack);
  checkMemory(file, layout, memoryLimitBytes);
  checkFileSize(file, pages, first, layout);
  const bool contiguous = isContiguous(file, pages, first, stack);
  if (stack.times > 1) {
    say("frames: the first of " + std::to_string(stack.times) + " time steps is loaded, " +
        std::to_string(stack.times - 1) + " are left out");
  }
  if (pages.hasPalette(0)) say("the indices are loaded, the palette is left out");

  PageReader reader(path, pages, first, layout.type, contiguous);
  LoadedFile loaded;
  loaded.grid.dims = layout.dims;
  for (int axis = 0; axis < 3; ++axis) loaded.grid.worldFromVoxel[axis][axis] = stack.spacing[axis];
  loaded.channels = channelsOf(path, first, stack, layout, readSamples(reader, first, stack, layout), warn);
  if (loaded.channels.empty())
    throw Error(ErrorCode::unsupported, file + ": expected a channel beside alpha, found none");
  if (int(loaded.channels.size()) < layout.channels) say("alpha is left out");
  return loaded;
}

}  // namespace scolopax::io
