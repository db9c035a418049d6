// SPDX-License-Identifier: Apache-2.0
// Writes NRRD (teem.sourceforge.net/nrrd/format.html) that nrrd.cpp reads back exactly, names included.
#include <charconv>
#include <sstream>

#include "renderer/core/error.h"
#include "renderer/io/nrrd_write.h"
#include "renderer/io/output_file.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

/// The shortest decimal that reads back as the same double.
std::string exactText(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// A key/value pair ends with its line, so the format escapes line ends and backslashes.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\n')
      result += "\\n";
    else if (c == '\\')
      result += "\\\\";
    else
      result += c;
  }
  return result;
}

std::string_view nrrdName(ScalarType type) {
  switch (type) {
    case ScalarType::u8:
      return "uint8";
    case ScalarType::u16:
      return "uint16";
    case ScalarType::i16:
      return "int16";
    case ScalarType::f32:
      return "float";
  }
  return "";
}

void writeHeader(std::ostream& out, const Grid& grid, std::span<const ChannelSource> channels) {
  const auto writeVector = [&](glm::dvec3 ras) {
    out << '(' << exactText(-ras.x) << ',' << exactText(-ras.y) << ',' << exactText(ras.z) << ')';
  };
  const auto& m = grid.worldFromVoxel;
  out << "NRRD0005\ntype: " << nrrdName(channels[0].voxels.type())
      << "\ndimension: 4\nspace: left-posterior-superior\nsizes:";
  for (int axis = 0; axis < 3; ++axis) out << ' ' << std::to_string(grid.dims[axis]);
  out << ' ' << std::to_string(channels.size()) << "\nspace directions: ";
  for (int axis = 0; axis < 3; ++axis) {
    writeVector(glm::dvec3(m[axis]));
    out << ' ';
  }
  out << "none\nspace origin: ";
  writeVector(glm::dvec3(m[3]));
  out << "\nkinds: domain domain domain list\nendian: little\nencoding: raw\n";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::string key = "channel " + std::to_string(i) + " ";
    if (!channels[i].name.empty()) out << key << "name:=" << escaped(channels[i].name) << '\n';
    if (!channels[i].unit.empty()) out << key << "unit:=" << escaped(channels[i].unit) << '\n';
    if (channels[i].slope != 1) out << key << "slope:=" << exactText(channels[i].slope) << '\n';
    if (channels[i].intercept != 0) out << key << "intercept:=" << exactText(channels[i].intercept) << '\n';
  }
  out << '\n';
}

}  // namespace

void writeNrrd(const std::filesystem::path& path, const Grid& grid, std::span<const ChannelSource> channels) {
  if (channels.empty())
    throw Error(ErrorCode::badInput, shown(path) + ": expected channels to write, found none");
  for (const ChannelSource& channel : channels) {
    if (channel.voxels.type() != channels[0].voxels.type() || channel.voxels.count() != grid.voxelCount()) {
      throw Error(ErrorCode::badInput, shown(path) + ": channel " + inQuotes(channel.name) +
                                           ": expected the first channel's type and the grid's size");
    }
  }
  std::ostringstream stream;
  writeHeader(stream, grid, channels);
  const std::string header = stream.str();
  std::vector<std::string_view> parts{header};
  for (const ChannelSource& channel : channels)
    parts.emplace_back(reinterpret_cast<const char*>(channel.voxels.data()), channel.voxels.sizeBytes());
  writeFile(path, parts);
}

}  // namespace scolopax::io
