// SPDX-License-Identifier: Apache-2.0
// Headerless voxels: files described by their name (name_XxYxZ_type.raw) or by an Inviwo or Voreen sidecar
// (.dat: "Key: value" lines, .ivf: XML).
#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <pugixml.hpp>
#include <regex>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLongestSidecar = 1 << 20;

struct RawDescription {
  fs::path data;
  VoxelLayout layout;
  glm::dvec3 spacing{1};
  std::uint64_t byteOffset = 0;
  bool mayHoldMore = false;  ///< the sidecar gives an offset, so bytes after the voxels are allowed
};

Error badField(const fs::path& file, std::string_view field, const std::string& expected,
               std::string_view found) {
  return Error(ErrorCode::badInput, shown(file) + ": " + std::string(field) + ": expected " + expected +
                                        ", found " + inQuotes(found));
}

std::string readSidecar(const fs::path& path) {
  ByteStream stream(path, ByteStream::Encoding::plain);
  if (stream.largestSize() > kLongestSidecar) {
    throw Error(ErrorCode::badInput, shown(path) + ": expected a text header of at most 1 MiB, found " +
                                         std::to_string(stream.largestSize()) + " bytes");
  }
  std::string text(std::size_t(stream.largestSize()), '\0');
  text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
  return text;
}

/// Inviwo's and Voreen's names: UCHAR or UINT8, USHORT, FLOAT, FLOAT32, ...
StoredType sidecarType(const fs::path& file, std::string_view format) {
  static const std::map<std::string, StoredType, std::less<>> kAliases = {
      {"char", StoredType::i8},    {"uchar", StoredType::u8},  {"short", StoredType::i16},
      {"ushort", StoredType::u16}, {"int", StoredType::i32},   {"uint", StoredType::u32},
      {"float", StoredType::f32},  {"half", StoredType::f16},  {"double", StoredType::f64},
      {"long", StoredType::i64},   {"ulong", StoredType::u64},
  };
  const std::string name = lowerCase(format);
  if (const auto type = storedTypeFromName(name)) return *type;
  const auto alias = kAliases.find(name);
  if (alias == kAliases.end()) {
    throw badField(file, "Format", "one scalar type such as UCHAR, UINT16 or FLOAT32", format);
  }
  return alias->second;
}

glm::ivec3 sidecarDims(const fs::path& file, std::string_view field, std::string_view x, std::string_view y,
                       std::string_view z) {
  std::array<std::int64_t, 3> dims{};
  const std::array texts{x, y, z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto value = parseInteger(texts[axis]);
    if (!value) throw badField(file, field, "three whole numbers", texts[axis]);
    dims[axis] = *value;
  }
  return checkedDims(shown(file) + ": " + std::string(field), dims[0], dims[1], dims[2]);
}

void setByteOffset(RawDescription& raw, const fs::path& file, std::string_view text) {
  const auto bytes = parseInteger(trimmed(text));
  if (!bytes || *bytes < 0) throw badField(file, "ByteOffset", "a whole number, 0 or more", text);
  raw.byteOffset = std::uint64_t(*bytes);
  raw.mayHoldMore = true;
}

/// The fields of a .dat file, by key in lower case.
class DatFields {
 public:
  explicit DatFields(const fs::path& path) : path_(path), text_(readSidecar(path)) {
    for (std::string_view rest = text_; !rest.empty();) {
      const std::string_view line = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(rest.size(), line.size() + 1));
      if (trimmed(line).empty() || trimmed(line).starts_with('#')) continue;
      const auto colon = line.find(':');
      if (colon == std::string_view::npos) throw badField(path, "header", "lines of \"Key: value\"", line);
      const std::string key = lowerCase(trimmed(line.substr(0, colon)));
      if (!left_.emplace(key, trimmed(line.substr(colon + 1))).second) {
        throw badField(path, "header", "every key once", key);
      }
    }
  }
  DatFields(const DatFields&) = delete;
  DatFields& operator=(const DatFields&) = delete;

  /// Takes the fields with these names out; returns the last one's value.
  std::optional<std::string_view> take(std::initializer_list<const char*> names) {
    std::optional<std::string_view> value;
    for (const char* name : names) {
      if (const auto field = left_.extract(name)) value = field.mapped();
    }
    return value;
  }
  /// The same for a field that must be there.
  std::string_view required(std::string_view shownName, std::initializer_list<const char*> names) {
    const auto value = take(names);
    if (!value)
      throw Error(ErrorCode::badInput, shown(path_) + ": " + std::string(shownName) + ": is missing");
    return *value;
  }
  /// Fields that nobody has taken.
  const std::map<std::string, std::string_view>& left() const { return left_; }

 private:
  const fs::path& path_;
  const std::string text_;
  std::map<std::string, std::string_view> left_;
};

bool isBigEndian(const fs::path& path, std::string_view order) {
  const std::string name = lowerCase(order);
  if (!name.starts_with("big") && !name.starts_with("little")) {
    throw badField(path, "ByteOrder", "LittleEndian or BigEndian", order);
  }
  return name.starts_with("big");
}

glm::dvec3 datSpacing(const fs::path& path, std::string_view thickness) {
  const auto lengths = splitWords(thickness);
  glm::dvec3 spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto length = lengths.size() == 3 ? parseNumber(lengths[axis]) : std::nullopt;
    if (!length || !(*length > 0) || !std::isfinite(*length)) {
      throw badField(path, "SliceThickness", "three lengths above 0", thickness);
    }
    spacing[int(axis)] = *length;
  }
  return spacing;
}

RawDescription fromDat(const fs::path& path, const Warn& warn) {
  DatFields fields(path);
  RawDescription raw;
  const std::string_view resolution = fields.required("Resolution", {"resolution"});
  const auto words = splitWords(resolution);
  if (words.size() != 3) throw badField(path, "Resolution", "three whole numbers", resolution);
  raw.layout.dims = sidecarDims(path, "Resolution", words[0], words[1], words[2]);
  raw.layout.type = sidecarType(path, fields.required("Format", {"format"}));
  if (const auto order = fields.take({"byteorder", "endianess", "endianness", "endian"}))
    raw.layout.bigEndian = isBigEndian(path, *order);
  if (const auto thickness = fields.take({"slicethickness", "spacing"}))
    raw.spacing = datSpacing(path, *thickness);
  if (const auto offset = fields.take({"byteoffset"})) setByteOffset(raw, path, *offset);
  raw.data = resolveDataFile(path, "ObjectFileName",
                             fields.required("ObjectFileName", {"objectfilename", "rawfile"}), ".gz");
  for (const auto& [key, value] : fields.left()) {
    if (warn) warn(shown(path) + ": " + cleanText(key) + ": is not used");
  }
  return raw;
}

RawDescription fromIvf(const fs::path& path) {
  const std::string text = readSidecar(path);
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  const pugi::xml_node root = document.child("InviwoTreeData");
  if (!parsed || !root) {
    throw Error(ErrorCode::badInput, shown(path) + ": expected XML with the element InviwoTreeData, found " +
                                         (parsed ? "another one" : parsed.description()) + " at byte " +
                                         std::to_string(parsed.offset));
  }
  const auto required = [&](const char* element, const char* attribute) {
    const pugi::xml_attribute found = root.child(element).attribute(attribute);
    if (!found) {
      throw Error(ErrorCode::badInput,
                  shown(path) + ": " + element + ": attribute " + attribute + " is missing");
    }
    return trimmed(found.value());
  };
  RawDescription raw;
  raw.layout.dims = sidecarDims(path, "Dimension", required("Dimension", "x"), required("Dimension", "y"),
                                required("Dimension", "z"));
  raw.layout.type = sidecarType(path, required("Format", "content"));
  if (const pugi::xml_node offset = root.child("ByteOffset"))
    setByteOffset(raw, path, offset.attribute("content").value());
  for (const pugi::xml_node item : root.child("MetaDataMap").children("MetaDataItem")) {
    if (std::string_view(item.attribute("key").value()) != "LittleEndian") continue;
    const std::string_view value = item.child("MetaData").attribute("content").value();
    if (value != "0" && value != "1") throw badField(path, "LittleEndian", "0 or 1", value);
    raw.layout.bigEndian = value == "0";
  }
  raw.data = resolveDataFile(path, "RawFile", required("RawFile", "content"), ".gz");
  return raw;
}

/// Dims and type in a name such as name_4x3x2_uint8.raw; none if it has another form.
struct NamedVoxels {
  std::string x, y, z;
  StoredType type;
};

std::optional<NamedVoxels> parseName(const fs::path& path) {
  static const std::regex kPattern(R"(^.*_(\d+)x(\d+)x(\d+)_([a-z]+\d+)(\.[^_]*)?\.raw(\.gz)?$)");
  const std::string name = path.filename().string();
  std::smatch match;
  if (!std::regex_match(name, match, kPattern)) return std::nullopt;
  const auto type = storedTypeFromName(match[4].str());
  if (!type) return std::nullopt;
  return NamedVoxels{match[1].str(), match[2].str(), match[3].str(), *type};
}

RawDescription fromName(const fs::path& path) {
  requireRegularFile(path);
  const auto named = parseName(path);
  if (!named) {
    throw badField(path, "file name",
                   "name_XxYxZ_type.raw with a type from int8 to float64, or a .nhdr, .dat or .ivf header to "
                   "open instead",
                   path.filename().string());
  }
  RawDescription raw;
  raw.data = path;
  raw.layout.type = named->type;
  raw.layout.dims = sidecarDims(path, "file name", named->x, named->y, named->z);
  return raw;
}

bool isPacked(const RawDescription& raw) { return hasEnding(raw.data, ".gz"); }

ByteStream streamOf(const RawDescription& raw) {
  return ByteStream(raw.data, isPacked(raw) ? ByteStream::Encoding::gzip : ByteStream::Encoding::plain);
}

std::uint64_t expectedBytes(const RawDescription& raw) {
  return saturatingSum(raw.byteOffset, raw.layout.sizeBytes());
}

void checkFileSize(const std::string& file, const RawDescription& raw) {
  const ByteStream stream = streamOf(raw);
  if (isPacked(raw)) return checkFileHolds(stream, raw.layout, raw.byteOffset);
  const std::uint64_t expected = expectedBytes(raw), found = stream.largestSize();
  if (expected == found || (raw.mayHoldMore && expected < found)) return;
  throw Error(ErrorCode::badInput, file + ": " + raw.layout.description() + ": expected a data file of " +
                                       std::to_string(expected) + " bytes, found " + std::to_string(found));
}

std::vector<VoxelBuffer> readRaw(const std::string& file, const RawDescription& raw, const VolumeInfo& volume,
                                 const Part& part, Loading& loading) {
  ByteStream stream = streamOf(raw);
  auto writers = makeWriters(file, volume, part, loading);
  readSamples(stream, raw.byteOffset, raw.layout, {0}, writers);
  if (!raw.mayHoldMore && !stream.atEnd()) {
    throw Error(ErrorCode::badInput, file + ": " + raw.layout.description() + ": expected data of " +
                                         std::to_string(expectedBytes(raw)) + " bytes, found more");
  }
  return takeAll(writers);
}

}  // namespace

Match matchRaw(const FileStart& start) {
  if (start.folder) return Match::no;
  // Such a name is the header, whatever the voxels look like.
  if (parseName(start.path)) return Match::content;
  if (start.holds("<InviwoTreeData")) return Match::content;
  const bool named = start.hasEnding(".raw") || start.hasEnding(".raw.gz") || start.hasEnding(".dat") ||
                     start.hasEnding(".ivf");
  return named ? Match::name : Match::no;
}

VolumeFile openRaw(const fs::path& path, const OpenOptions& options) {
  const RawDescription raw = hasEnding(path, ".dat")   ? fromDat(path, options.warn)
                             : hasEnding(path, ".ivf") ? fromIvf(path)
                                                       : fromName(path);
  const std::string file = shown(path);
  checkFileSize(file, raw);
  VolumeFile result{path};
  if (raw.data != path) result.dataFiles = {raw.data};
  const Grid grid{raw.layout.dims, glm::scale(glm::dmat4(1.0), raw.spacing)};
  result.volumes = {VolumeInfo{.levels = {grid}, .channels = {ChannelInfo{.type = raw.layout.type}}}};
  result.read = [file, raw](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readRaw(file, raw, volume, part, loading);
  };
  return result;
}

}  // namespace scolopax::io
