// SPDX-License-Identifier: Apache-2.0
// SLC, the volumes of VolVis: a text header, an icon, and slices of 8-bit voxels, plain or run-length
// encoded. VTK reads the same; VolVis's C_volvis.h and C_io.c define it.
#include <algorithm>
#include <array>
#include <cmath>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// A run is two bytes and at most 127 voxels.
constexpr std::uint64_t kSlcRatio = 64;

struct SlcHeader {
  glm::ivec3 dims{1};
  glm::dvec3 spacing{1};
  std::string unit = {};
  bool packed = false;
  std::uint64_t dataOffset = 0;
};

/// Reads the words and bytes of the file.
class SlcStream {
 public:
  explicit SlcStream(const fs::path& path) : bytes(path, ByteStream::Encoding::detect), file_(shown(path)) {}

  /// The next word that ends at a blank, which is read as well.
  std::string word(std::string_view field) {
    constexpr std::size_t kLongestWord = 64;
    std::string text;
    for (char c = next(); !isBlank(c) || text.empty(); c = next()) {
      if (isBlank(c)) continue;
      text += c;
      if (text.size() > kLongestWord) throw bad(field, "a number", text);
    }
    return text;
  }
  std::int64_t integer(std::string_view field, std::int64_t lowest, std::int64_t highest) {
    const std::string text = word(field);
    const auto value = parseInteger(text);
    if (!value || *value < lowest || *value > highest)
      throw bad(field, "a whole number from " + std::to_string(lowest) + " to " + std::to_string(highest),
                text);
    return *value;
  }
  double length(std::string_view field) {
    const std::string text = word(field);
    const auto value = parseNumber(text);
    if (!value || !std::isfinite(*value) || *value <= 0) throw bad(field, "a number above 0", text);
    return *value;
  }
  /// The letter before binary data.
  void mark(std::string_view field) {
    char c = next();
    while (isBlank(c)) c = next();
    if (c != 'X') throw bad(field, "the letter X behind it", std::string(1, c));
  }
  Error bad(std::string_view field, const std::string& expected, std::string_view found) const {
    return Error(ErrorCode::badInput,
                 file_ + ": " + std::string(field) + ": expected " + expected + ", found " + inQuotes(found));
  }

  ByteStream bytes;

 private:
  static bool isBlank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  char next() {
    char c{};
    bytes.read(std::as_writable_bytes(std::span(&c, 1)));
    return c;
  }
  std::string file_;
};

SlcHeader readSlcHeader(const std::string& file, SlcStream& stream) {
  SlcHeader header;
  if (const std::string magic = stream.word("magic"); magic != "11111")
    throw stream.bad("magic", "11111", magic);
  std::array<std::int64_t, 3> dims{};
  for (std::int64_t& size : dims) size = stream.integer("size", 1, kMaxVolumeSide);
  header.dims = checkedDims(file + ": size", dims[0], dims[1], dims[2]);
  if (const std::string bits = stream.word("bits per voxel"); bits != "8")
    throw Error(ErrorCode::unsupported, stream.bad("bits per voxel", "8", bits).what());
  for (int axis = 0; axis < 3; ++axis) header.spacing[axis] = stream.length("spacing");
  static constexpr std::array kUnits{"m", "mm", "um", "ft", "in"};
  header.unit = kUnits[std::size_t(stream.integer("unit", 0, kUnits.size() - 1))];
  constexpr std::int64_t kMostKinds = 1 << 16;
  stream.integer("data origin", 0, kMostKinds);
  stream.integer("data modification", 0, kMostKinds);
  header.packed = stream.integer("compression", 0, 1) == 1;
  const auto width = std::uint64_t(stream.integer("icon", 0, 1 << 16)),
             height = std::uint64_t(stream.integer("icon", 0, 1 << 16));
  stream.mark("icon");
  header.dataOffset = stream.bytes.position() + 3 * width * height;  // red, green and blue

  const VoxelLayout layout{.dims = header.dims};
  const std::uint64_t largest = stream.bytes.largestSize(),
                      left = largest - std::min(largest, header.dataOffset);
  const std::uint64_t holds = header.packed ? saturatingProduct(left, kSlcRatio) : left;
  if (layout.sizeBytes() > holds)
    throw Error(ErrorCode::badInput, file + ": size: " + layout.description() + " needs " +
                                         byteCount(layout.sizeBytes()) + ", the file holds at most " +
                                         byteCount(holds));
  return header;
}

/// Decodes one slice: bytes of 7 bits of count, above which 1 means that so many voxels follow and 0 that the
/// next voxel is repeated. A count of 0 ends the slice. Returns false unless it fills the slice exactly.
bool decodeSlc(std::span<const std::byte> packed, std::span<std::byte> slice) {
  while (!packed.empty()) {
    const auto code = std::to_integer<unsigned>(packed[0]);
    const std::size_t count = code & 0x7F, used = code & 0x80 ? count : 1;
    if (count == 0) break;
    packed = packed.subspan(1);
    if (count > slice.size() || used > packed.size()) return false;
    if (code & 0x80)
      std::ranges::copy(packed.first(count), slice.begin());
    else
      std::ranges::fill(slice.first(count), packed[0]);
    packed = packed.subspan(used);
    slice = slice.subspan(count);
  }
  return slice.empty();
}

std::vector<VoxelBuffer> readSlc(const fs::path& path, const VolumeInfo& volume, const Part& part,
                                 Loading& loading) {
  const std::string file = shown(path);
  SlcStream stream(path);
  const SlcHeader header = readSlcHeader(file, stream);
  if (header.dims != volume.levels[0].dims)
    throw Error(ErrorCode::badInput, file + ": size: expected the same as before, found another");
  auto writers = makeWriters(file, volume, part, loading);
  if (!header.packed) {
    readSamples(stream.bytes, header.dataOffset, {.dims = header.dims}, {0}, writers);
    return takeAll(writers);
  }
  stream.bytes.skip(header.dataOffset - stream.bytes.position());
  const std::size_t sliceBytes = std::size_t(header.dims.x) * std::size_t(header.dims.y);
  // Literal runs take one byte more than 127 voxels; more than two bytes for each voxel is no encoder's work.
  const std::uint64_t mostPacked =
      std::min<std::uint64_t>(stream.bytes.largestSize(), 2 * std::uint64_t(sliceBytes) + 1);
  loading.checkMemory(file + ": a slice", saturatingSum(sliceBytes, mostPacked));
  std::vector<std::byte> slice(sliceBytes), packed;
  for (int z = 0; z < header.dims.z; ++z) {
    const std::string field = "slice " + std::to_string(z);
    packed.resize(std::size_t(stream.integer(field, 0, std::int64_t(mostPacked))));
    stream.mark(field);
    stream.bytes.read(packed);
    if (!decodeSlc(packed, slice))
      throw stream.bad(field, "runs of " + std::to_string(sliceBytes) + " voxels", "others");
    writers[0].write(std::size_t(z) * sliceBytes, slice);
  }
  return takeAll(writers);
}

}  // namespace

Match matchSlc(const FileStart& start) {
  constexpr std::size_t kWords = 12, kLongest = 512;
  if (start.holds("11111\n") || start.holds("11111\r\n") || start.holds("11111 ")) {
    const auto words = splitWords(std::string_view(start.unpacked).substr(0, kLongest));
    const auto isNumber = [](std::string_view word) { return parseNumber(word).has_value(); };
    if (words.size() > kWords && std::all_of(words.begin(), words.begin() + kWords, isNumber))
      return Match::content;
  }
  return start.hasEnding(".slc") && !start.folder ? Match::name : Match::no;
}

VolumeFile openSlc(const fs::path& path, const OpenOptions&) {
  SlcStream stream(path);
  const SlcHeader header = readSlcHeader(shown(path), stream);
  Grid grid{header.dims};
  for (int axis = 0; axis < 3; ++axis) grid.worldFromVoxel[axis][axis] = header.spacing[axis];
  VolumeFile file{path};
  file.volumes = {{.levels = {grid}, .channels = {{.type = StoredType::u8}}, .worldUnit = header.unit}};
  file.read = [path](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readSlc(path, volume, part, loading);
  };
  return file;
}

}  // namespace scolopax::io
