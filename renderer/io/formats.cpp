// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/formats.h"

#include <cmath>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

// A reader without its library is not even named, so that it need not exist.
constexpr Format kFormats[] = {
#define X(NAME, shown, endings, missing) \
  {shown, endings, missing, match##NAME, std::string_view(missing).empty() ? open##NAME : nullptr},
    SCOLOPAX_FORMATS(X)
#undef X
};

constexpr std::size_t kStartBytes = 4096;

std::string firstBytes(const fs::path& path, ByteStream::Encoding encoding) {
  ByteStream stream(path, encoding);
  std::string bytes(kStartBytes, '\0');
  bytes.resize(stream.readSome(std::as_writable_bytes(std::span(bytes))));
  return bytes;
}

FileStart startOf(const fs::path& path) {
  FileStart start{path};
  if (isUrl(path)) return start;
  std::error_code ignored;
  start.folder = fs::is_directory(path, ignored);
  if (start.folder) return start;
  start.bytes = firstBytes(path, ByteStream::Encoding::plain);
  start.unpacked = start.bytes;
  if (!start.bytes.starts_with("\x1F\x8B")) return start;
  try {
    start.unpacked = firstBytes(path, ByteStream::Encoding::detect);
  } catch (const Error&) {  // not gzip, or damaged: the reader will tell
  }
  return start;
}

std::string knownFormats() {
  std::string known;
  for (const Format& format : kFormats)
    known +=
        (known.empty() ? "" : "; ") + std::string(format.name) + " (" + std::string(format.endings) + ")";
  return known;
}

FormatMatch matchOf(const FileStart& start) {
  FormatMatch best;
  for (const Format& format : kFormats) {
    const Match match = format.match(start);
    if (match == Match::content) return {&format, match};
    if (match > best.match) best = {&format, match};
  }
  return best;
}

const Format& formatOf(const fs::path& path) {
  const FileStart start = startOf(path);
  if (const Format* format = matchOf(start).format) return *format;
  throw Error(ErrorCode::unsupported, shown(path) + ": expected " +
                                          (start.folder ? "a file, or a folder of " : "") + "one of " +
                                          knownFormats());
}

/// Cleans names, gives names to channels without one, and checks what a reader must have checked.
void complete(VolumeFile& file) {
  const std::string name = shown(file.path);
  if (file.volumes.empty()) throw Error(ErrorCode::badInput, name + ": expected a volume, found none");
  for (VolumeInfo& volume : file.volumes) {
    const std::string where = volume.path.empty() ? name : name + ":" + cleanText(volume.path);
    if (volume.levels.empty() || volume.channels.empty() || volume.times.count == 0)
      throw Error(ErrorCode::badInput, where + ": expected levels, channels and times, found none");
    for (const Grid& grid : volume.levels) {
      try {
        checkGrid(grid);
      } catch (const Error& error) {  // whose message does not name the file
        throw Error(error.code(), where + ": " + error.what());
      }
    }
    volume.path = cleanText(volume.path);
    while (volume.path.starts_with('/')) volume.path.erase(0, 1);
    while (volume.path.ends_with('/')) volume.path.pop_back();
    volume.worldUnit = cleanText(volume.worldUnit);
    volume.times.unit = cleanText(volume.times.unit);
    const std::string base = volume.path.empty() ? stemOf(file.path) : volume.path;
    for (std::size_t i = 0; i < volume.channels.size(); ++i) {
      ChannelInfo& channel = volume.channels[i];
      channel.name = cleanText(channel.name);
      channel.unit = cleanText(channel.unit);
      if (channel.name.empty())
        channel.name = volume.channels.size() == 1 ? base : base + " " + std::to_string(i);
      const auto& window = channel.look.window;
      if (window && !(std::isfinite(window->lo) && std::isfinite(window->hi) && window->lo < window->hi))
        channel.look.window.reset();
    }
  }
}

}  // namespace

bool isUrl(const fs::path& path) {
  const std::string start = lowerCase(path.string().substr(0, 8));
  return start.starts_with("http://") || start == "https://";
}

bool FileStart::hasEnding(std::string_view ending) const { return io::hasEnding(path, ending); }

bool FileStart::holds(std::string_view magic, std::size_t offset) const {
  const auto at = [&](const std::string& text) {
    return text.size() >= offset + magic.size() &&
           std::string_view(text).substr(offset, magic.size()) == magic;
  };
  return at(bytes) || at(unpacked);
}

bool FileStart::contains(std::string_view entry) const {
  std::error_code ignored;
  return folder && fs::exists(path / entry, ignored);
}

std::span<const Format> formats() { return kFormats; }

FormatMatch findMatch(const fs::path& path) {
  try {
    return matchOf(startOf(path));
  } catch (const Error&) {  // cannot be read
    return {};
  }
}

const Format* findFormat(const fs::path& path) { return findMatch(path).format; }

std::shared_ptr<const VolumeFile> openFile(const Format& format, const fs::path& path,
                                           const OpenOptions& options) {
  if (!format.missing.empty())
    throw Error(ErrorCode::unsupported, shown(path) + ": " + std::string(format.name) +
                                            " needs the library of " + std::string(format.missing) +
                                            ", without which this program was built");
  OpenOptions always = options;
  if (!always.warn) always.warn = [](const std::string&) {};
  auto file = std::make_shared<VolumeFile>(format.open(path, always));
  complete(*file);
  return file;
}

std::shared_ptr<const VolumeFile> openFile(const fs::path& path, const OpenOptions& options) {
  return openFile(formatOf(path), path, options);
}

}  // namespace scolopax::io
