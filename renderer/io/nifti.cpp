// SPDX-License-Identifier: Apache-2.0
// NIfTI-1 and NIfTI-2 (nifti.nimh.nih.gov), single files and .hdr + .img pairs, packed or not. Parsed by
// hand, because libnifti2 does not check every size before it allocates memory.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/matrix.hpp>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kNifti1Bytes = 348, kNifti2Bytes = 540;
constexpr std::int64_t kMostNiftiChannels = 4096;  ///< of which users may choose

/// The header fields that are used, in the wider types of version 2.
struct NiftiHeader {
  std::string file;  ///< for messages
  bool bigEndian = false, pair = false;
  int datatype = 0, bitpix = 0, qformCode = 0, sformCode = 0, units = 0, intent = 0;
  std::array<std::int64_t, 8> dim{};
  std::array<double, 8> pixdim{};
  double slope = 0, intercept = 0, timeOffset = 0;
  std::uint64_t dataOffset = 0;
  std::array<double, 6> quaternion{};  ///< b, c, d, and the offset x, y, z
  std::array<double, 12> rows{};       ///< sform: three rows of four
};

Error badField(const NiftiHeader& header, std::string_view field, const std::string& expected,
               const std::string& found) {
  return Error(ErrorCode::badInput,
               header.file + ": " + std::string(field) + ": expected " + expected + ", found " + found);
}

/// Numbers at byte positions of a header, in its byte order.
class HeaderBytes {
 public:
  HeaderBytes(std::span<const std::byte> bytes, bool bigEndian) : bytes_(bytes), bigEndian_(bigEndian) {}
  template <class T>
  T at(std::size_t position) const {
    std::array<std::byte, sizeof(T)> value;
    std::memcpy(value.data(), bytes_.data() + position, sizeof(T));
    if (bigEndian_) std::reverse(value.begin(), value.end());
    return std::bit_cast<T>(value);
  }
  /// Copies N numbers of type T, from `position` on, to `to`.
  template <class T, class To, std::size_t N>
  void copy(std::size_t position, std::array<To, N>& to) const {
    for (std::size_t i = 0; i < N; ++i) to[i] = static_cast<To>(at<T>(position + i * sizeof(T)));
  }

 private:
  std::span<const std::byte> bytes_;
  bool bigEndian_;
};

void setDataOffset(NiftiHeader& header, double offset, std::size_t headerBytes) {
  const double smallest = header.pair ? 0.0 : double(headerBytes) + 4;
  if (!(offset >= smallest && offset < 0x1p53 && offset == std::floor(offset))) {
    throw badField(header, "vox_offset", "a whole number, at least " + std::to_string(int(smallest)),
                   shortText(offset));
  }
  header.dataOffset = std::uint64_t(offset);
}

void readVersion1(NiftiHeader& header, const HeaderBytes& bytes) {
  bytes.copy<std::int16_t>(40, header.dim);
  header.datatype = bytes.at<std::int16_t>(70);
  header.bitpix = bytes.at<std::int16_t>(72);
  bytes.copy<float>(76, header.pixdim);
  setDataOffset(header, bytes.at<float>(108), kNifti1Bytes);
  header.slope = bytes.at<float>(112);
  header.intercept = bytes.at<float>(116);
  header.units = bytes.at<std::uint8_t>(123);
  header.intent = bytes.at<std::int16_t>(68);
  header.timeOffset = bytes.at<float>(136);
  header.qformCode = bytes.at<std::int16_t>(252);
  header.sformCode = bytes.at<std::int16_t>(254);
  bytes.copy<float>(256, header.quaternion);
  bytes.copy<float>(280, header.rows);
}

void readVersion2(NiftiHeader& header, const HeaderBytes& bytes) {
  header.datatype = bytes.at<std::int16_t>(12);
  header.bitpix = bytes.at<std::int16_t>(14);
  bytes.copy<std::int64_t>(16, header.dim);
  bytes.copy<double>(104, header.pixdim);
  setDataOffset(header, double(bytes.at<std::int64_t>(168)), kNifti2Bytes);
  header.slope = bytes.at<double>(176);
  header.intercept = bytes.at<double>(184);
  header.qformCode = bytes.at<std::int32_t>(344);
  header.sformCode = bytes.at<std::int32_t>(348);
  bytes.copy<double>(352, header.quaternion);
  bytes.copy<double>(400, header.rows);
  header.units = bytes.at<std::int32_t>(500);
  header.intent = bytes.at<std::int32_t>(504);
  header.timeOffset = bytes.at<double>(216);
}

NiftiHeader readHeader(ByteStream& stream) {
  NiftiHeader header;
  header.file = shown(stream.path());
  std::array<std::byte, kNifti2Bytes> buffer{};
  stream.read(std::span(buffer).first(kNifti1Bytes));
  std::int32_t size;
  std::memcpy(&size, buffer.data(), sizeof size);
  const auto swapped = std::int32_t(__builtin_bswap32(std::uint32_t(size)));
  header.bigEndian = swapped == int(kNifti1Bytes) || swapped == int(kNifti2Bytes);
  if (header.bigEndian) size = swapped;
  if (size != int(kNifti1Bytes) && size != int(kNifti2Bytes)) {
    throw badField(header, "sizeof_hdr", "348 or 540", std::to_string(size));
  }
  const bool version2 = size == int(kNifti2Bytes);
  if (version2) stream.read(std::span(buffer).subspan(kNifti1Bytes));

  const std::string_view bytes(reinterpret_cast<const char*>(buffer.data()), buffer.size());
  const std::string_view magic = version2 ? bytes.substr(4, 8) : bytes.substr(344, 4);
  const std::string_view single =
      version2 ? std::string_view("n+2\0\r\n\032\n", 8) : std::string_view("n+1\0", 4);
  const std::string_view pair =
      version2 ? std::string_view("ni2\0\r\n\032\n", 8) : std::string_view("ni1\0", 4);
  if (magic != single && magic != pair) {
    throw badField(header, "magic", version2 ? "n+2 or ni2" : "n+1 or ni1", inQuotes(magic));
  }
  header.pair = magic == pair;
  const HeaderBytes fields(buffer, header.bigEndian);
  if (version2)
    readVersion2(header, fields);
  else
    readVersion1(header, fields);
  return header;
}

struct VoxelType {
  StoredType type;
  int samples;  ///< 3 for RGB24, 4 for RGBA32
};

VoxelType voxelType(const NiftiHeader& header) {
  const VoxelType voxel = [&]() -> VoxelType {
    switch (header.datatype) {
      case 2:
        return {StoredType::u8, 1};
      case 4:
        return {StoredType::i16, 1};
      case 8:
        return {StoredType::i32, 1};
      case 16:
        return {StoredType::f32, 1};
      case 64:
        return {StoredType::f64, 1};
      case 128:
        return {StoredType::u8, 3};
      case 256:
        return {StoredType::i8, 1};
      case 512:
        return {StoredType::u16, 1};
      case 768:
        return {StoredType::u32, 1};
      case 1024:
        return {StoredType::i64, 1};
      case 1280:
        return {StoredType::u64, 1};
      case 2304:
        return {StoredType::u8, 4};
      default:
        break;
    }
    const bool isComplex = header.datatype == 32 || header.datatype == 1792 || header.datatype == 2048;
    throw Error(ErrorCode::unsupported,
                header.file + ": datatype: expected integers, float32, float64 or RGB, found " +
                    std::to_string(header.datatype) + (isComplex ? " (complex)" : ""));
  }();
  const int bits = int(sizeBytes(voxel.type)) * 8 * voxel.samples;
  if (header.bitpix != 0 && header.bitpix != bits) {
    throw badField(header, "bitpix",
                   std::to_string(bits) + " for datatype " + std::to_string(header.datatype),
                   std::to_string(header.bitpix));
  }
  return voxel;
}

/// The unit of the fourth axis by NIfTI's codes; "" if it has none.
std::string timeUnit(const NiftiHeader& header) {
  switch (header.units & 0x38) {
    case 8:
      return "s";
    case 16:
      return "ms";
    case 24:
      return "us";
    case 32:
      return "Hz";
    case 40:
      return "ppm";
    case 48:
      return "rad/s";
    default:
      return "";
  }
}

/// Whether the fourth axis, of `size`, is channels. docs/files.md states the rule.
bool isChannelAxis(const NiftiHeader& header, std::int64_t size, FourthAxis fourthAxis) {
  if (fourthAxis != FourthAxis::automatic) return fourthAxis == FourthAxis::channel;
  // Matrices, vectors (displacements too), RGB and RGBA; time series.
  constexpr std::array kVectors{1004, 1005, 1006, 1007, 2003, 2004};
  if (std::ranges::find(kVectors, header.intent) != kVectors.end()) return true;
  constexpr int kTimeSeries = 2001;
  const bool isFloat = header.datatype == 16 || header.datatype == 64;
  return header.intent != kTimeSeries && size == 3 && (isFloat || timeUnit(header).empty());
}

/// The layout of one time, and how many times there are.
struct NiftiLayout {
  VoxelLayout voxels;
  std::size_t times = 1;
  std::uint64_t timeBytes = 0;  ///< from one time to the next
};

NiftiLayout niftiLayout(const NiftiHeader& header, FourthAxis fourthAxis) {
  const std::int64_t used = header.dim[0];
  if (used < 1 || used > 7) throw badField(header, "dim[0]", "1 to 7", std::to_string(used));
  const auto dim = [&](int i) { return i <= used ? header.dim[std::size_t(i)] : 1; };
  const VoxelType voxel = voxelType(header);
  NiftiLayout layout;
  VoxelLayout& voxels = layout.voxels;
  voxels.type = voxel.type;
  voxels.bigEndian = header.bigEndian;
  voxels.dims = checkedDims(header.file + ": dim", dim(1), dim(2), dim(3));
  for (int i = 4; i <= 7; ++i) {
    if (dim(i) < 0)
      throw badField(header, "dim[" + std::to_string(i) + "]", "0 or more", std::to_string(dim(i)));
    if (i >= 6 && dim(i) > 1) {
      throw Error(ErrorCode::unsupported, header.file + ": dim[" + std::to_string(i) +
                                              "]: expected 1, found " + std::to_string(dim(i)));
    }
  }
  std::int64_t times = std::max<std::int64_t>(dim(4), 1), vectorLength = std::max<std::int64_t>(dim(5), 1);
  const char* vectorField = "dim[5]";
  if (vectorLength == 1 && times > 1 && isChannelAxis(header, times, fourthAxis)) {
    std::swap(times, vectorLength);
    vectorField = "dim[4]";
  }
  if (vectorLength > 1 && voxel.samples > 1) {
    throw Error(ErrorCode::unsupported, header.file + ": " + vectorField +
                                            ": expected 1 for RGB voxels, found " +
                                            std::to_string(vectorLength));
  }
  if (vectorLength > kMostNiftiChannels) {
    throw Error(ErrorCode::unsupported, header.file + ": " + vectorField + ": expected at most " +
                                            std::to_string(kMostNiftiChannels) + " channels, found " +
                                            std::to_string(vectorLength));
  }
  voxels.samples = std::size_t(vectorLength > 1 ? vectorLength : voxel.samples);
  voxels.interleaved = voxel.samples > 1;
  layout.times = std::size_t(times);
  const std::uint64_t volumeBytes =
      saturatingProduct(voxels.voxelCount(), sizeBytes(voxels.type) * std::uint64_t(voxel.samples));
  layout.timeBytes = volumeBytes;
  // Times vary faster than components.
  if (vectorLength > 1) voxels.gapBytes = saturatingProduct(volumeBytes, std::uint64_t(times - 1));
  return layout;
}

bool isUsable(const glm::dmat4& m) {
  double product = 1;
  for (int column = 0; column < 4; ++column) {
    const glm::dvec3 v(m[column]);
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return false;
    if (column < 3) product *= std::sqrt(glm::dot(v, v));
  }
  return product > 0 && std::abs(glm::determinant(glm::dmat3(m))) > 1e-6 * product;
}

/// Method 3 of nifti1.h.
glm::dmat4 affineFromRows(const NiftiHeader& header) {
  glm::dmat4 m(1.0);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) m[column][row] = header.rows[std::size_t(row * 4 + column)];
  return m;
}

/// Method 2 of nifti1.h: a rotation by the quaternion (a, b, c, d), steps of pixdim, z flipped by qfac.
glm::dmat4 affineFromQuaternion(const NiftiHeader& header, glm::dvec3 spacing) {
  auto [b, c, d, x, y, z] = header.quaternion;
  const double square = b * b + c * c + d * d;
  const double a = square < 1 ? std::sqrt(1 - square) : 0;
  if (square > 1) {  // a half turn, exceeded by rounding
    const double length = std::sqrt(square);
    b /= length, c /= length, d /= length;
  }
  const double qfac = header.pixdim[0] < 0 ? -1 : 1;
  glm::dmat4 m(1.0);
  m[0] = spacing.x * glm::dvec4(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c), 0);
  m[1] = spacing.y * glm::dvec4(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b), 0);
  m[2] = spacing.z * qfac *
         glm::dvec4(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c, 0);
  m[3] = glm::dvec4(x, y, z, 1);
  return m;
}

/// World space is RAS in millimetres: by sform, else qform, else pixdim.
glm::dmat4 worldFromVoxel(const NiftiHeader& header, const Warn& warn) {
  const auto say = [&](const std::string& text) {
    if (warn) warn(header.file + ": " + text);
  };
  glm::dvec3 spacing(1);
  for (int axis = 0; axis < 3; ++axis) {
    const double step = std::abs(header.pixdim[std::size_t(axis) + 1]);
    if (std::isfinite(step) && step > 0)
      spacing[axis] = step;
    else if (axis < header.dim[0])
      say("pixdim[" + std::to_string(axis + 1) + "]: is not a length, taken as 1");
  }
  const glm::dmat4 fromRows = affineFromRows(header), fromQuaternion = affineFromQuaternion(header, spacing);
  glm::dmat4 m(1.0);
  for (int axis = 0; axis < 3; ++axis) m[axis][axis] = spacing[axis];
  if (header.sformCode > 0 && isUsable(fromRows)) {
    m = fromRows;
  } else {
    if (header.sformCode > 0) say("sform: is singular or not finite, not used");
    if (header.qformCode > 0 && isUsable(fromQuaternion))
      m = fromQuaternion;
    else if (header.qformCode > 0)
      say("qform: is singular or not finite, not used");
  }
  const int lengthUnit = header.units & 7;
  const double millimetres = lengthUnit == 1 ? 1e3 : lengthUnit == 3 ? 1e-3 : 1.0;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) m[column][row] *= millimetres;
  return m;
}

/// The file with `ending` (".img") in place of the path's, or its packed form. Throws Error(notFound).
fs::path sibling(const fs::path& path, const char* ending) {
  fs::path base = path;
  if (hasEnding(base, ".gz")) base.replace_extension();
  for (const std::string& candidate : {std::string(ending), ending + std::string(".gz")}) {
    fs::path other = base;
    other.replace_extension(candidate);
    std::error_code error;
    if (fs::exists(other, error)) return other;
  }
  throw Error(ErrorCode::notFound, shown(path) +
                                       ": expected the other file of the pair beside it, found no " +
                                       shown(base.replace_extension(ending)));
}

std::vector<ChannelInfo> niftiChannels(const NiftiHeader& header, const VoxelLayout& layout,
                                       const std::string& stem) {
  if (layout.interleaved) {
    return {{.name = stem + " red", .type = layout.type},
            {.name = stem + " green", .type = layout.type},
            {.name = stem + " blue", .type = layout.type}};
  }
  ChannelInfo channel{.type = layout.type};
  if (std::isfinite(header.slope) && header.slope != 0) {  // 0 means no scaling
    channel.slope = header.slope;
    channel.intercept = std::isfinite(header.intercept) ? header.intercept : 0.0;
  }
  constexpr int kLabels = 1002;
  channel.look.labels = header.intent == kLabels;
  return std::vector(layout.samples, channel);
}

Times niftiTimes(const NiftiHeader& header, std::size_t count) {
  Times times{.count = count};
  const double step = header.pixdim[4];
  constexpr std::size_t kMostValues = 1 << 20;
  if (count == 1 || count > kMostValues || !(std::isfinite(step) && step > 0)) return times;
  const double offset = std::isfinite(header.timeOffset) ? header.timeOffset : 0;
  for (std::size_t i = 0; i < count; ++i) times.values.push_back(offset + double(i) * step);
  times.unit = timeUnit(header);
  return times;
}

bool isImageOfPair(const fs::path& path) { return hasEnding(path, ".img") || hasEnding(path, ".img.gz"); }

}  // namespace

Match matchNifti(const FileStart& start) {
  const bool magic = start.holds(std::string_view("n+1\0", 4), 344) ||
                     start.holds(std::string_view("ni1\0", 4), 344) ||
                     start.holds(std::string_view("n+2\0\r\n\032\n", 8), 4) ||
                     start.holds(std::string_view("ni2\0\r\n\032\n", 8), 4);
  if (magic) return Match::content;
  for (const char* ending : {".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz"})
    if (!start.folder && start.hasEnding(ending)) return Match::name;
  return Match::no;
}

VolumeFile openNifti(const fs::path& path, const OpenOptions& options) {
  requireRegularFile(path);
  const bool isImage = isImageOfPair(path);
  ByteStream headerStream(isImage ? sibling(path, ".hdr") : path, ByteStream::Encoding::detect);
  const NiftiHeader header = readHeader(headerStream);
  const NiftiLayout layout = niftiLayout(header, options.fourthAxis);
  const fs::path data = header.pair && !isImage ? sibling(path, ".img") : path;

  VolumeFile file{path};
  if (data != path) file.dataFiles = {data};
  const Grid grid{layout.voxels.dims, worldFromVoxel(header, options.warn)};
  file.volumes = {{.levels = {grid},
                   .times = niftiTimes(header, layout.times),
                   .channels = niftiChannels(header, layout.voxels, stemOf(path)),
                   .worldUnit = (header.units & 7) != 0 ? "mm" : ""}};
  if (layout.voxels.samples == 4 && layout.voxels.interleaved)
    options.warn(header.file + ": RGBA voxels: alpha is left out");
  const auto offsetOf = [header, layout](std::size_t time) {
    return saturatingSum(header.dataOffset, saturatingProduct(layout.timeBytes, time));
  };
  checkFileHolds(ByteStream(data, ByteStream::Encoding::detect), layout.voxels, offsetOf(layout.times - 1));
  file.read = [data, layout, offsetOf, name = header.file](const VolumeInfo& volume, const Part& part,
                                                           Loading& loading) {
    ByteStream stream(data, ByteStream::Encoding::detect);
    auto writers = makeWriters(name, volume, part, loading);
    readSamples(stream, offsetOf(part.time), layout.voxels, part.channels, writers);
    return takeAll(writers);
  };
  return file;
}

}  // namespace scolopax::io
