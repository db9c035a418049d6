// SPDX-License-Identifier: Apache-2.0
// DICOM (dicom.nema.org): a file, or a folder with files of one or more series. GDCM parses and decodes.
#include <algorithm>
#include <array>
#include <cstring>
#include <map>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/dicom_decoding.h"
#include "renderer/io/dicom_series.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr int kDeepestDicomFolder = 5;

/// Whether a file starts like DICOM: after a preamble, or with elements that come first without one.
bool startsLikeDicom(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.size() >= 132 && bytes.substr(128, 4) == "DICM") return true;
  static constexpr std::array kFirst{"\x08\0\0\0UL"sv,   "\x08\0\x01\0UL"sv, "\x08\0\x05\0CS"sv,
                                     "\x08\0\x08\0CS"sv, "\x08\0\x16\0UI"sv, "\x02\0\0\0UL"sv};
  return std::ranges::any_of(kFirst, [&](std::string_view first) { return bytes.starts_with(first); });
}

/// Whether a zip archive begins with names of DICOM files.
bool isZippedDicom(const FileStart& start) {
  return start.bytes.starts_with("PK\x03\x04") && lowerCase(start.bytes).find(".dcm") != std::string::npos;
}

bool isDicomFile(const fs::path& path) {
  std::error_code failed;
  if (!fs::is_regular_file(path, failed) || path.filename() == "DICOMDIR") return false;
  if (hasEnding(path, ".dcm")) return true;
  std::array<char, 132> bytes{};
  try {
    ByteStream stream(path, ByteStream::Encoding::plain);
    const std::size_t got = stream.readSome(std::as_writable_bytes(std::span(bytes)));
    return startsLikeDicom({bytes.data(), got});
  } catch (const Error&) {
    return false;
  }
}

/// Whether all DICOM files below a folder belong together, not only those directly in it.
bool hasDicomDirectory(const fs::path& folder) {
  std::error_code failed;
  return fs::exists(folder / "DICOMDIR", failed);
}

/// DICOM files in a folder, and below it if it has a DICOMDIR, sorted; at most `mostFiles` of them, after at
/// most `mostEntries`.
std::vector<fs::path> dicomFilesIn(const fs::path& folder, std::size_t mostFiles, std::size_t mostEntries,
                                   const std::stop_token& stop) {
  std::vector<fs::path> files;
  const int deepest = hasDicomDirectory(folder) ? kDeepestDicomFolder : 0;
  std::error_code failed;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, failed), end;
  for (std::size_t seen = 0; !failed && entry != end && files.size() < mostFiles && seen < mostEntries;
       entry.increment(failed), ++seen) {
    if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
    if (entry.depth() >= deepest) entry.disable_recursion_pending();
    if (isDicomFile(entry->path())) files.push_back(entry->path());
  }
  std::ranges::sort(files);
  return files;
}

#if SCOLOPAX_HAS_GDCM
std::vector<fs::path> dicomFilesOf(const fs::path& path, const OpenOptions& options) {
  constexpr std::size_t kMostFiles = 20'000, kMostEntries = 200'000;
  std::error_code failed;
  if (!fs::is_directory(path, failed)) return {path};
  auto files = dicomFilesIn(path, kMostFiles + 1, kMostEntries, options.stop);
  if (files.size() > kMostFiles)
    throw Error(ErrorCode::tooLarge, shown(path) + ": expected at most " + std::to_string(kMostFiles) +
                                         " DICOM files, found more");
  return files;
}

/// The headers of all files that can be read; of the others, warnings. Throws the first Error if there are
/// only such.
std::vector<DicomFile> readDicomFolder(const fs::path& path, const OpenOptions& options) {
  constexpr std::size_t kMostNamed = 3, kMostFrames = 1 << 20;
  std::vector<DicomFile> files;
  std::vector<Error> errors;
  std::size_t failed = 0, frames = 0;
  const auto take = [&](DicomFile file) {
    for (const std::string& line : file.warnings) options.warn(shown(file.path) + ": " + line);
    frames += file.frames.size();
    if (frames > kMostFrames)
      throw Error(ErrorCode::tooLarge,
                  shown(path) + ": expected at most " + std::to_string(kMostFrames) + " slices, found more");
    files.push_back(std::move(file));
  };
  const auto fail = [&](const Error& error) {
    if (failed++ < kMostNamed) errors.push_back(error);
  };
  readDicomHeaders(dicomFilesOf(path, options), options.stop, take, fail);
  if (files.empty() && !errors.empty()) throw errors[0];
  for (const Error& error : errors) options.warn(error.what());
  if (failed > errors.size())
    options.warn(shown(path) + ": " + std::to_string(failed - errors.size()) + " more files cannot be read");
  return files;
}

/// What is needed to read voxels later.
struct DicomVolumes {
  std::string file;  ///< for messages
  std::vector<DicomFile> files;
  std::vector<DicomSeries> series;
};

/// A frame as data values.
std::vector<float> rescaledDicomFrame(const DicomFile& file, const DicomFrame& frame,
                                      std::span<const std::byte> bytes) {
  const auto convert = [&]<class T>(T value) {
    std::vector<float> values(bytes.size() / sizeof value);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::memcpy(&value, bytes.data() + i * sizeof value, sizeof value);
      values[i] = float(frame.slope * double(value) + frame.intercept);
    }
    return values;
  };
  switch (file.type) {
    case StoredType::i8:
      return convert(std::int8_t());
    case StoredType::i16:
      return convert(std::int16_t());
    case StoredType::u16:
      return convert(std::uint16_t());
    case StoredType::i32:
      return convert(std::int32_t());
    case StoredType::u32:
      return convert(std::uint32_t());
    default:
      return convert(std::uint8_t());
  }
}

/// Writes the samples of one slice that are channels of the part.
void writeDicomSlice(const DicomVolumes& dicom, const DicomSeries& series, const DicomSlice& slice,
                     const DecodedFrame& decoded, const Part& part, std::vector<ChannelWriter>& writers) {
  const DicomFile& file = dicom.files[slice.file];
  const std::size_t pixels = std::size_t(file.columns * file.rows);
  std::vector<float> values;
  std::span<const std::byte> bytes = decoded.bytes;
  if (series.rescaled) {
    values = rescaledDicomFrame(file, file.frames[slice.frame], bytes);
    bytes = std::as_bytes(std::span(values));
  }
  const std::size_t number = bytes.size() / (pixels * file.samples);
  for (std::size_t i = 0; i < writers.size(); ++i) {
    const std::size_t channel = part.channels[i], sample = series.sparse ? 0 : channel;
    if (series.sparse && channel != slice.channel) continue;
    const std::byte* first = bytes.data() + sample * number * (decoded.planar ? pixels : 1);
    writers[i].writeStrided(slice.z * pixels, pixels, first,
                            std::ptrdiff_t(number * (decoded.planar ? 1 : file.samples)));
  }
}

std::vector<VoxelBuffer> readDicom(const DicomVolumes& dicom, const VolumeInfo& volume, const Part& part,
                                   Loading& loading) {
  const DicomSeries& series = dicom.series[part.volume];
  auto writers = makeWriters(dicom.file, volume, part, loading);
  if (series.sparse)
    for (ChannelWriter& writer : writers) writer.fill(0);
  std::vector<DicomFrames> wanted;
  std::map<std::pair<std::size_t, std::size_t>, const DicomSlice*> sliceOf;
  for (const DicomSlice& slice : series.slices) {
    const bool chosen = !series.sparse || std::ranges::count(part.channels, slice.channel) > 0;
    if (slice.time != part.time || !chosen) continue;
    const DicomFile* file = &dicom.files[slice.file];
    if (wanted.empty() || wanted.back().file != file) wanted.push_back({file});
    wanted.back().frames.push_back(slice.frame);
    sliceOf[{wanted.size() - 1, slice.frame}] = &slice;
  }
  decodeDicomFrames(wanted, loading, [&](const DecodedFrame& decoded) {
    writeDicomSlice(dicom, series, *sliceOf.at({decoded.wanted, decoded.frame}), decoded, part, writers);
  });
  return takeAll(writers);
}
#endif

}  // namespace

Match matchDicom(const FileStart& start) {
  constexpr std::size_t kMostEntries = 2000;
  if (start.folder) {
    if (hasDicomDirectory(start.path)) return Match::content;
    return dicomFilesIn(start.path, 1, kMostEntries, {}).empty() ? Match::no : Match::files;
  }
  if (startsLikeDicom(start.bytes) || isZippedDicom(start)) return Match::content;
  return start.hasEnding(".dcm") || start.hasEnding(".dicom") ? Match::name : Match::no;
}

#if SCOLOPAX_HAS_GDCM
VolumeFile openDicom(const fs::path& path, const OpenOptions& options) {
  std::error_code failed;
  if (fs::is_regular_file(path, failed) && hasEnding(path, ".zip"))
    throw Error(ErrorCode::unsupported,
                shown(path) + ": zip archives of DICOM files are not read: unpack it and give the folder");
  auto dicom = std::make_shared<DicomVolumes>();
  dicom->file = shown(path);
  dicom->files = readDicomFolder(path, options);
  dicom->series = arrangeDicom(dicom->files, dicom->file, options.warn);
  VolumeFile file{path};
  for (DicomSeries& series : dicom->series) file.volumes.push_back(std::move(series.info));
  file.read = [dicom](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readDicom(*dicom, volume, part, loading);
  };
  return file;
}
#endif

}  // namespace scolopax::io
