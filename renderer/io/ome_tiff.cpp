// SPDX-License-Identifier: Apache-2.0
// OME-TIFF (docs.openmicroscopy.org/ome-model): series of planes in one or several TIFFs, described by
// OME-XML in the first page or in a companion file. Pyramids are in SubIFDs.
#include <algorithm>
#include <array>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/ome_series.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kLargestOmeXml = std::uint64_t(256) << 20;
constexpr std::size_t kMostOmeChannelsOfAll = 1 << 16;

struct OmeSet {
  std::vector<fs::path> files;
  std::vector<OmeSeries> series;  ///< one for each volume
};

bool isTiff(std::string_view bytes) {
  using namespace std::string_view_literals;
  return std::ranges::any_of(std::array{"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv},
                             [&](std::string_view magic) { return bytes.starts_with(magic); });
}

/// The document that describes a file, and the file that holds it.
struct OmeSource {
  fs::path holder;
  std::string where;  ///< for messages
  bool inTiff = false;
  OmeDocument document;
};

OmeSource omeFromText(const fs::path& path, const Warn& warn) {
  ByteStream stream(path, ByteStream::Encoding::plain);
  if (stream.largestSize() > kLargestOmeXml)
    throw Error(ErrorCode::tooLarge, shown(path) + ": expected at most 256 MiB of OME-XML, found " +
                                         byteCount(stream.largestSize()));
  std::string text(std::size_t(stream.largestSize()), '\0');
  text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
  return {path, shown(path), false, parseOmeXml(shown(path), text, warn)};
}

OmeSource omeSource(const fs::path& path, const Warn& warn) {
  std::string magic(4, '\0');
  ByteStream(path, ByteStream::Encoding::plain).readSome(std::as_writable_bytes(std::span(magic)));
  if (!isTiff(magic)) return omeFromText(path, warn);
  const std::string where = shown(path) + ": ImageDescription";
  OmeSource source{path, where, true, parseOmeXml(where, TiffPages(path, 1).description(0), warn)};
  if (source.document.companion.empty()) return source;
  return omeFromText(
      resolveDataFile(path, "ImageDescription: BinaryOnly: MetadataFile", source.document.companion), warn);
}

/// Names of several images, or their numbers if names are missing or alike.
std::vector<std::string> omePaths(const std::vector<std::string>& names) {
  const std::set<std::string> distinct(names.begin(), names.end());
  const bool usable = distinct.size() == names.size() && !distinct.contains("");
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < names.size(); ++i)
    paths.push_back(names.size() == 1 ? "" : usable ? names[i] : std::to_string(i));
  return paths;
}

/// A plane that a part needs.
struct WantedPlane {
  OmePlane at;
  std::int64_t slice = 0;
  int plane = 0;  ///< along the channels
};

/// The planes of a part in the order of the files, so that each is opened once.
std::vector<WantedPlane> wantedPlanes(const OmeSeries& series, const Part& part) {
  std::set<int> planes;
  for (const std::size_t channel : part.channels) planes.insert(int(channel) / series.samples);
  std::vector<WantedPlane> wanted;
  for (const int plane : planes)
    for (std::int64_t slice = 0; slice < series.planes.slices; ++slice) {
      const auto found =
          series.planes.found.find(series.planes.indexOf(slice, plane, std::int64_t(part.time)));
      if (found != series.planes.found.end()) wanted.push_back({found->second, slice, plane});
    }
  std::ranges::sort(wanted, {}, [](const WantedPlane& w) { return std::pair(w.at.file, w.at.page); });
  return wanted;
}

/// Reads one page into `buffer`, after checking that it is like the others.
void readOmePage(TiffPages& pages, const OmePlane& at, const OmeSeries& series, const Part& part,
                 const glm::ivec3& dims, std::vector<std::byte>& buffer, Loading& loading) {
  const std::string where = shown(pages.filename()) + ": page " + std::to_string(at.page + 1);
  if (at.page >= pages.pageCount() || part.level >= pages.levelCount(at.page))
    throw Error(ErrorCode::badInput,
                where + ": expected a picture of level " + std::to_string(part.level) + ", found none");
  const auto input = openTiffPage(pages, at.page, part.level);
  const OIIO::ImageSpec& spec = input->spec();
  OIIO::ImageSpec expected(dims.x, dims.y, series.samples, series.numbers);
  if (omePageText(spec) != omePageText(expected) || spec.depth > 1)
    throw Error(ErrorCode::unsupported,
                where + ": expected " + omePageText(expected) + ", found " + omePageText(spec));
  tiffStoredType(where, spec);
  if (spec.image_bytes(true) > saturatingProduct(pages.fileSize(), tiffExpansion(spec)))
    throw Error(ErrorCode::badInput, where + ": " + omePageText(spec) + " needs " +
                                         byteCount(spec.image_bytes(true)) + ", the file holds fewer");
  loading.checkMemory(where, spec.image_bytes(true));
  buffer.resize(spec.image_bytes(true));
  input->geterror();  // discards what opening recorded: only warnings
  if (!readTiffPixels(*input, buffer) || input->has_error())
    throw Error(ErrorCode::badInput, where + ": cannot be decoded: " + cleanText(input->geterror()));
}

std::vector<VoxelBuffer> readOme(const OmeSet& set, const fs::path& path, const VolumeInfo& volume,
                                 const Part& part, Loading& loading) {
  const OmeSeries& series = set.series[part.volume];
  const glm::ivec3 dims = volume.levels[part.level].dims;
  const std::size_t pixels = std::size_t(dims.x) * std::size_t(dims.y),
                    numberBytes = sizeBytes(volume.channels[0].type), samples = std::size_t(series.samples);
  auto writers = makeWriters(shown(path), volume, part, loading);
  if (std::int64_t(series.planes.found.size()) < series.planes.count())
    for (ChannelWriter& writer : writers) writer.fill(0);
  std::unique_ptr<TiffPages> pages;
  std::size_t file = 0;
  std::vector<std::byte> buffer;
  for (const WantedPlane& wanted : wantedPlanes(series, part)) {
    if (!pages || wanted.at.file != file) pages = std::make_unique<TiffPages>(set.files[wanted.at.file]);
    file = wanted.at.file;
    readOmePage(*pages, wanted.at, series, part, dims, buffer, loading);
    for (std::size_t i = 0; i < writers.size(); ++i) {
      const int channel = int(part.channels[i]);
      if (channel / series.samples != wanted.plane) continue;
      writers[i].writeStrided(std::size_t(wanted.slice) * pixels, pixels,
                              buffer.data() + std::size_t(channel % series.samples) * numberBytes,
                              std::ptrdiff_t(samples * numberBytes));
    }
  }
  return takeAll(writers);
}

}  // namespace

Match matchOmeTiff(const FileStart& start) {
  const bool companion = start.hasEnding(".ome") || start.hasEnding(".ome.xml");
  if (start.folder) return Match::no;
  if (companion && looksLikeOmeXml(start.bytes)) return Match::content;
  if (!isTiff(start.bytes)) return Match::no;
  try {
    return looksLikeOmeXml(TiffPages(start.path, 1).description(0)) ? Match::content : Match::no;
  } catch (const Error&) {  // TIFF's reader tells what is wrong
    return Match::no;
  }
}

VolumeFile openOmeTiff(const fs::path& path, const OpenOptions& options) {
  const OmeSource source = omeSource(path, options.warn);
  OmeFiles files(source.holder, source.inTiff, source.document);
  const auto set = std::make_shared<OmeSet>();
  VolumeFile file{path};
  std::vector<std::string> names;
  std::optional<Error> failed;
  std::size_t channels = 0;
  const std::vector<OmeImage>& images = source.document.images;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string where = source.where + (images.size() > 1 ? ": Image " + std::to_string(i) : "");
    try {
      OmeSeries series;
      file.volumes.push_back(openOmeImage(where, images[i], files, series, options.warn));
      set->series.push_back(std::move(series));
      names.push_back(images[i].name);
      channels += file.volumes.back().channels.size();
    } catch (const Error& error) {  // the other images may be sound
      if (images.size() == 1) throw;
      if (!failed) failed = error;
      options.warn(std::string(error.what()) + "; left out");
    }
    if (channels > kMostOmeChannelsOfAll)
      throw Error(ErrorCode::unsupported, where + ": expected at most " +
                                              std::to_string(kMostOmeChannelsOfAll) +
                                              " channels of all images, found more");
  }
  if (file.volumes.empty() && failed) throw *failed;
  if (file.volumes.empty())
    throw Error(ErrorCode::badInput, source.where + ": expected an Image with Pixels, found none");
  const std::vector<std::string> paths = omePaths(names);
  for (std::size_t i = 0; i < paths.size(); ++i) file.volumes[i].path = paths[i];
  set->files = files.paths();
  file.dataFiles = files.paths();
  file.dataFiles.push_back(source.holder);
  std::erase(file.dataFiles, path);
  file.read = [set, path](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readOme(*set, path, volume, part, loading);
  };
  return file;
}

}  // namespace scolopax::io
