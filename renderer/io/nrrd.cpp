// SPDX-License-Identifier: Apache-2.0
// NRRD (teem.sourceforge.net/nrrd/format.html), attached and detached, raw and gzip. Parsed by hand: the
// header is simple text, and teem allocates the memory that the header claims before looking at the data.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/nrrd_header.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMostAxes = 16;  // NRRD_DIM_MAX of the format

StoredType storedType(const NrrdHeader& header) {
  static const std::map<std::string_view, StoredType> kNames = {
      {"signed char", StoredType::i8},
      {"int8", StoredType::i8},
      {"int8_t", StoredType::i8},
      {"uchar", StoredType::u8},
      {"unsigned char", StoredType::u8},
      {"uint8", StoredType::u8},
      {"uint8_t", StoredType::u8},
      {"short", StoredType::i16},
      {"short int", StoredType::i16},
      {"signed short", StoredType::i16},
      {"signed short int", StoredType::i16},
      {"int16", StoredType::i16},
      {"int16_t", StoredType::i16},
      {"ushort", StoredType::u16},
      {"unsigned short", StoredType::u16},
      {"unsigned short int", StoredType::u16},
      {"uint16", StoredType::u16},
      {"uint16_t", StoredType::u16},
      {"int", StoredType::i32},
      {"signed int", StoredType::i32},
      {"int32", StoredType::i32},
      {"int32_t", StoredType::i32},
      {"uint", StoredType::u32},
      {"unsigned int", StoredType::u32},
      {"uint32", StoredType::u32},
      {"uint32_t", StoredType::u32},
      {"longlong", StoredType::i64},
      {"long long", StoredType::i64},
      {"long long int", StoredType::i64},
      {"signed long long", StoredType::i64},
      {"signed long long int", StoredType::i64},
      {"int64", StoredType::i64},
      {"int64_t", StoredType::i64},
      {"ulonglong", StoredType::u64},
      {"unsigned long long", StoredType::u64},
      {"unsigned long long int", StoredType::u64},
      {"uint64", StoredType::u64},
      {"uint64_t", StoredType::u64},
      {"float", StoredType::f32},
      {"double", StoredType::f64},
  };
  const std::string_view name = header.require("type");
  const auto found = kNames.find(std::string_view(lowerCase(name)));
  if (found == kNames.end()) throw header.unsupported("type", "a scalar type", name);
  return found->second;
}

/// One axis of the array, fastest first.
struct Axis {
  std::int64_t size = 1;
  bool spatial = true;
  std::string kind;  ///< lower case; "" if the header gives none
  std::string unit;  ///< "" if the header gives none
  double spacing = 1;
  bool hasSpacing = false;
  std::optional<glm::dvec3> direction;
};

glm::dvec3 parseVector(const NrrdHeader& header, std::string_view field, std::string_view text) {
  glm::dvec3 vector;
  std::string_view rest = text;
  const bool enclosed = rest.starts_with('(') && rest.ends_with(')') && rest.size() >= 2;
  if (enclosed) rest = rest.substr(1, rest.size() - 2);
  for (int axis = 0; axis < 3; ++axis) {
    const auto comma = rest.find(',');
    const auto value = parseNumber(trimmed(rest.substr(0, comma)));
    const bool last = comma == std::string_view::npos;
    if (!enclosed || !value || !std::isfinite(*value) || last != (axis == 2)) {
      throw header.bad(field, "vectors of three numbers such as (1,0,0)", text);
    }
    vector[axis] = *value;
    if (!last) rest.remove_prefix(comma + 1);
  }
  return vector;
}

/// Splits "(1,0,0) none (0, 1, 0)" into its parts: spaces inside the brackets do not separate.
std::vector<std::string> splitVectors(std::string_view text) {
  std::vector<std::string> parts;
  bool inside = false, open = false;
  for (const char c : text) {
    if (c == '(') inside = true;
    const bool blank = c == ' ' || c == '\t';
    if (!blank || inside) {
      if (!open) parts.emplace_back();
      open = true;
      if (!blank) parts.back() += c;
    } else {
      open = false;
    }
    if (c == ')') inside = open = false;
  }
  return parts;
}

/// The words in quotes of a field such as units: "mm" "mm" "s".
std::vector<std::string> quotedWords(std::string_view text) {
  std::vector<std::string> words;
  for (std::size_t at = text.find('"'); at != std::string_view::npos; at = text.find('"', at)) {
    const std::size_t end = text.find('"', at + 1);
    if (end == std::string_view::npos) break;
    words.emplace_back(text.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return words;
}

bool isTimeUnit(const std::string& unit) {
  static constexpr std::array kTimes{"s", "sec", "second", "seconds", "ms", "us", "min", "h"};
  return std::ranges::find(kTimes, lowerCase(unit)) != kTimes.end();
}

std::vector<Axis> readAxes(const NrrdHeader& header, const Warn& warn) {
  const auto dimension = parseInteger(header.require("dimension"));
  if (!dimension || *dimension < 1 || *dimension > kMostAxes) {
    throw header.bad("dimension", "1 to 16", header.require("dimension"));
  }
  std::vector<Axis> axes(static_cast<std::size_t>(*dimension));
  // Calls take(axis, word) with the field's words, one per axis.
  const auto perAxis = [&](const char* field, std::string_view text, const auto& words, auto&& take) {
    if (words.size() != axes.size()) throw header.bad(field, std::to_string(axes.size()) + " entries", text);
    for (std::size_t i = 0; i < axes.size(); ++i) take(axes[i], words[i]);
  };
  const std::string_view sizes = header.require("sizes");
  perAxis("sizes", sizes, splitWords(sizes), [&](Axis& axis, std::string_view word) {
    const auto size = parseInteger(word);
    if (!size || *size < 1) throw header.bad("sizes", "whole numbers, 1 or more", sizes);
    axis.size = *size;
  });
  if (const auto kinds = header.find("kinds")) {
    perAxis("kinds", *kinds, splitWords(*kinds), [&](Axis& axis, std::string_view word) {
      axis.kind = lowerCase(word);
      static constexpr std::array kSpatial{"domain", "space", "none", "???"};
      axis.spatial = std::ranges::find(kSpatial, axis.kind) != kSpatial.end();
      if (axis.kind == "complex") throw header.unsupported("kinds", "real voxels", word);
    });
  }
  if (const auto spacings = header.find("spacings")) {
    perAxis("spacings", *spacings, splitWords(*spacings), [&](Axis& axis, std::string_view word) {
      const auto spacing = parseNumber(word);
      if (!spacing) throw header.bad("spacings", "numbers", *spacings);
      axis.hasSpacing = std::isfinite(*spacing) && *spacing != 0;
      if (axis.hasSpacing)
        axis.spacing = *spacing;
      else if (axis.spatial && !std::isnan(*spacing))
        warn(header.file + ": spacings: 0 or infinite, taken as 1");
    });
  }
  if (const auto units = header.find("units")) {
    const auto words = quotedWords(*units);
    for (std::size_t i = 0; i < std::min(words.size(), axes.size()); ++i) axes[i].unit = words[i];
  }
  if (const auto directions = header.find("space directions")) {
    perAxis("space directions", *directions, splitVectors(*directions),
            [&](Axis& axis, const std::string& word) {
              axis.spatial = lowerCase(word) != "none";
              if (axis.spatial) axis.direction = parseVector(header, "space directions", word);
            });
  }
  return axes;
}

/// Signs that convert the header's space to RAS. Spaces without anatomical directions stay as they are.
glm::dvec3 rasSigns(const NrrdHeader& header) {
  if (const auto dimension = header.find("space dimension"); dimension && *dimension != "3") {
    throw header.unsupported("space dimension", "3", *dimension);
  }
  const auto space = header.find("space");
  if (!space) return glm::dvec3(1);
  const std::string name = lowerCase(*space);
  if (name == "right-anterior-superior" || name == "ras") return {1, 1, 1};
  if (name == "left-anterior-superior" || name == "las") return {-1, 1, 1};
  if (name == "left-posterior-superior" || name == "lps") return {-1, -1, 1};
  if (name == "scanner-xyz" || name == "3d-right-handed" || name == "3d-left-handed") return {1, 1, 1};
  throw header.unsupported("space", "a space of three dimensions", *space);
}

/// Marks one of four axes that the header leaves unmarked as not spatial: the last one, or the first if that
/// has a length of 3, as vectors have, and the last has not.
void markFourthAxis(std::vector<Axis>& axes) {
  const bool unmarked =
      axes.size() == 4 && std::ranges::all_of(axes, [](const Axis& axis) { return axis.spatial; });
  if (!unmarked) return;
  const bool first = axes.front().size == 3 && axes.back().size != 3;
  (first ? axes.front() : axes.back()).spatial = false;
}

/// Whether the axis that is not spatial is channels. docs/files.md states the rule.
bool isChannelAxis(const Axis& axis, FourthAxis fourthAxis) {
  if (fourthAxis != FourthAxis::automatic) return fourthAxis == FourthAxis::channel;
  static constexpr std::array kUnmarked{"", "domain", "space", "none", "???"};
  if (std::ranges::find(kUnmarked, axis.kind) == kUnmarked.end()) return axis.kind != "time";
  return !isTimeUnit(axis.unit) && axis.size == 3;
}

/// How the axes make up the volume: one to three spatial ones and at most one other, first or last.
struct Arrangement {
  VoxelLayout layout;  ///< the samples are channels, or the times if there are no channels
  Grid grid;
  bool samplesAreTimes = false;
  double timeStep = 0;  ///< 0 if the header does not tell
  std::string timeUnit;
};

/// Sets samples, and what they are, from the axis that is not spatial.
void arrangeOther(const NrrdHeader& header, const std::vector<Axis>& axes, const Axis& other,
                  FourthAxis fourthAxis, Arrangement& result) {
  constexpr std::int64_t kMostNrrdChannels = 4096, kMostTimes = 1 << 24;
  const bool interleaved = &other == &axes.front() && axes.size() > 1;
  result.samplesAreTimes = !isChannelAxis(other, fourthAxis);
  const std::int64_t most = interleaved || !result.samplesAreTimes ? kMostNrrdChannels : kMostTimes;
  if (other.size > most)
    throw header.unsupported("sizes",
                             "at most " + std::to_string(most) + " along an axis that is not spatial",
                             std::to_string(other.size));
  result.layout.samples = std::size_t(other.size);
  result.layout.interleaved = interleaved;
  if (!result.samplesAreTimes) return;
  result.timeStep = other.hasSpacing ? other.spacing : 0;
  result.timeUnit = other.unit;
}

/// The affine from voxels to world, RAS.
glm::dmat4 worldFromVoxel(const NrrdHeader& header, const std::vector<const Axis*>& spatial,
                          const Warn& warn) {
  const glm::dvec3 signs = rasSigns(header);
  glm::dmat4 m(1.0);
  for (int i = 0; i < int(spatial.size()); ++i) {
    const Axis& axis = *spatial[std::size_t(i)];
    glm::dvec3 step(0);
    step[i] = axis.spacing;
    m[i] = glm::dvec4(signs * axis.direction.value_or(step), 0);
  }
  if (const auto origin = header.find("space origin")) {
    m[3] = glm::dvec4(signs * parseVector(header, "space origin", *origin), 1);
  } else if (header.find("axis mins")) {
    warn(header.file + ": axis mins: is not used, the origin is 0");
  }
  return m;
}

Arrangement arrange(const NrrdHeader& header, const OpenOptions& options) {
  std::vector<Axis> axes = readAxes(header, options.warn);
  markFourthAxis(axes);
  Arrangement result;
  std::vector<const Axis*> spatial;
  const Axis* other = nullptr;
  for (const Axis& axis : axes) {
    if (axis.spatial) {
      spatial.push_back(&axis);
      continue;
    }
    if (other)
      throw header.unsupported("kinds", "at most one axis that is not spatial",
                               std::to_string(axes.size()) + " axes");
    if (&axis != &axes.front() && &axis != &axes.back()) {
      throw header.unsupported("kinds", "the axis that is not spatial first or last", axis.kind);
    }
    other = &axis;
  }
  if (spatial.empty() || spatial.size() > 3) {
    throw header.unsupported("kinds", "1 to 3 spatial axes and the others marked (list, vector, none)",
                             std::to_string(spatial.size()) + " spatial axes");
  }
  std::array<std::int64_t, 3> dims{1, 1, 1};
  for (std::size_t i = 0; i < spatial.size(); ++i) dims[i] = spatial[i]->size;
  result.layout.dims = checkedDims(header.file + ": sizes", dims[0], dims[1], dims[2]);
  if (other) arrangeOther(header, axes, *other, options.fourthAxis, result);
  result.grid = {result.layout.dims, worldFromVoxel(header, spatial, options.warn)};
  return result;
}

/// Throws Error(unsupported) if the data file's name stands for several files.
void refuseManyFiles(const NrrdHeader& header, std::string_view name) {
  const auto words = splitWords(name);
  const bool pattern = words.size() >= 4 && words[0].find('%') != std::string_view::npos;
  if (words.empty() || words[0] == "LIST" || pattern) {
    throw header.unsupported("data file", "one file", name.empty() ? "LIST" : name);
  }
}

std::int64_t skipField(const NrrdHeader& header, const char* field, std::int64_t smallest) {
  const auto text = header.find(field);
  if (!text) return 0;
  const auto value = parseInteger(*text);
  if (!value || *value < smallest)
    throw header.bad(field, "a whole number, at least " + std::to_string(smallest), *text);
  return *value;
}

/// The position after `lines` line ends, counted from `offset`.
std::uint64_t offsetBehindLines(const NrrdHeader& header, const fs::path& data, std::uint64_t offset,
                                std::int64_t lines) {
  if (lines == 0) return offset;
  ByteStream stream(data, ByteStream::Encoding::plain, offset);
  std::array<char, 1 << 14> buffer;
  for (std::uint64_t at = offset;;) {
    const std::size_t got = stream.readSome(std::as_writable_bytes(std::span(buffer)));
    if (got == 0)
      throw header.bad("line skip", "no more lines than the data file has", std::to_string(lines));
    for (std::size_t i = 0; i < got; ++i, ++at) {
      if (buffer[i] == '\n' && --lines == 0) return at + 1;
    }
  }
}

double pairNumber(const NrrdHeader& header, const std::string& key, double otherwise) {
  const auto pair = header.pairs.find(key);
  if (pair == header.pairs.end()) return otherwise;
  const auto value = parseNumber(trimmed(pair->second));
  if (!value || !std::isfinite(*value)) throw header.bad(key, "a number", pair->second);
  return *value;
}

/// Names, units and scales from the key/value pairs that writeNrrd writes.
std::vector<ChannelInfo> nrrdChannels(const NrrdHeader& header, StoredType type, std::size_t count,
                                      const std::string& stem) {
  const auto textOf = [&](const std::string& key) {
    const auto pair = header.pairs.find(key);
    return pair == header.pairs.end() ? std::string() : pair->second;
  };
  const auto kind = lowerCase(header.find("kinds").value_or(""));
  const bool rgb = count >= 3 && kind.find("rgb") != std::string::npos;
  static constexpr std::array kColors{"red", "green", "blue", "alpha"};
  std::vector<ChannelInfo> channels(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string key = "channel " + std::to_string(i) + " ";
    ChannelInfo& channel = channels[i];
    channel.type = type;
    channel.name = textOf(key + "name");
    channel.unit = textOf(key + "unit");
    if (channel.unit.empty()) channel.unit = std::string(header.find("sample units").value_or(""));
    if (channel.name.empty() && rgb && i < 4) channel.name = stem + " " + kColors[i];
    channel.slope = pairNumber(header, key + "slope", 1);
    if (channel.slope == 0) throw header.bad(key + "slope", "a number other than 0", "0");
    channel.intercept = pairNumber(header, key + "intercept", 0);
  }
  return channels;
}

Times nrrdTimes(const Arrangement& arrangement) {
  if (!arrangement.samplesAreTimes) return {};
  Times times{.count = arrangement.layout.samples, .unit = arrangement.timeUnit};
  constexpr std::size_t kMostValues = 1 << 20;
  if (arrangement.timeStep > 0 && times.count <= kMostValues)
    for (std::size_t i = 0; i < times.count; ++i) times.values.push_back(double(i) * arrangement.timeStep);
  return times;
}

/// The unit of space, if it is one for all axes.
std::string worldUnit(const NrrdHeader& header) {
  const auto units = quotedWords(header.find("space units").value_or(""));
  const bool one =
      !units.empty() && std::ranges::all_of(units, [&](const auto& unit) { return unit == units[0]; });
  return one ? units[0] : "";
}

/// Where the voxels are.
struct NrrdData {
  fs::path path;
  bool packed = false;
  std::uint64_t start = 0, offset = 0;  ///< of the stream in the file, and of the voxels in the stream

  ByteStream stream() const {
    return {path, packed ? ByteStream::Encoding::gzip : ByteStream::Encoding::plain, start};
  }
};

NrrdData findData(const NrrdHeader& header, const fs::path& path, const VoxelLayout& layout) {
  const std::string encoding = lowerCase(header.require("encoding"));
  NrrdData data{path, encoding == "gzip" || encoding == "gz"};
  if (!data.packed && encoding != "raw") throw header.unsupported("encoding", "raw or gzip", encoding);
  if (const auto name = header.find("data file")) {
    refuseManyFiles(header, *name);
    data.path = resolveDataFile(path, "data file", *name);
  } else if (header.attachedOffset) {
    data.start = *header.attachedOffset;
  } else {
    throw Error(ErrorCode::badInput,
                header.file + ": header: expected an empty line and data behind it, or a data file");
  }
  data.start = offsetBehindLines(header, data.path, data.start, skipField(header, "line skip", 0));
  const std::int64_t byteSkip = skipField(header, "byte skip", -1);
  data.offset = std::uint64_t(std::max<std::int64_t>(byteSkip, 0));
  const ByteStream stream = data.stream();
  if (byteSkip == -1) {  // the voxels are the file's last bytes
    if (data.packed) throw header.bad("byte skip", "0 or more for gzip data", "-1");
    checkFileHolds(stream, layout, 0);
    data.offset = stream.largestSize() - layout.sizeBytes();
  }
  checkFileHolds(stream, layout, data.offset);
  return data;
}

bool isBigEndianNrrd(const NrrdHeader& header, StoredType type) {
  if (sizeBytes(type) == 1) return false;
  const std::string order = lowerCase(header.require("endian"));
  if (order != "big" && order != "little") throw header.bad("endian", "little or big", order);
  return order == "big";
}

}  // namespace

Match matchNrrd(const FileStart& start) {
  if (start.bytes.starts_with("NRRD000")) return Match::content;
  const bool named = start.hasEnding(".nrrd") || start.hasEnding(".nhdr");
  return named && !start.folder ? Match::name : Match::no;
}

VolumeFile openNrrd(const fs::path& path, const OpenOptions& options) {
  const NrrdHeader header(path);
  Arrangement arrangement = arrange(header, options);
  VoxelLayout& layout = arrangement.layout;
  layout.type = storedType(header);
  layout.bigEndian = isBigEndianNrrd(header, layout.type);
  const NrrdData data = findData(header, path, layout);
  VolumeFile file{path};
  if (data.path != path) file.dataFiles = {data.path};
  const std::size_t channels = arrangement.samplesAreTimes ? 1 : layout.samples;
  file.volumes = {{.levels = {arrangement.grid},
                   .times = nrrdTimes(arrangement),
                   .channels = nrrdChannels(header, layout.type, channels, stemOf(path)),
                   .worldUnit = worldUnit(header)}};
  file.read = [data, layout, areTimes = arrangement.samplesAreTimes, name = header.file](
                  const VolumeInfo& volume, const Part& part, Loading& loading) {
    ByteStream stream = data.stream();
    auto writers = makeWriters(name, volume, part, loading);
    readSamples(stream, data.offset, layout, areTimes ? std::vector{part.time} : part.channels, writers);
    return takeAll(writers);
  };
  return file;
}

}  // namespace scolopax::io
