// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/random_scenes/random_volume.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <sstream>

#include "tests/renderer/random_scenes/draw.h"

namespace scolopax::random_scenes {
namespace {

/// Rounded to a float; through memory, because GCC 12 omits this rounding of neighbouring numbers.
double asFloat(double value) {
  volatile float rounded = float(value);
  return double(rounded);
}

glm::dmat3 rotation(Draw& draw) {
  const glm::dvec3 x = draw.direction();
  glm::dvec3 y = glm::cross(x, draw.direction());
  while (glm::length(y) < 0.1) y = glm::cross(x, draw.direction());
  y = glm::normalize(y);
  return {x, y, glm::cross(x, y)};
}

/// Mostly boxes along the axes; sometimes turned, mirrored, sheared, far from the origin, tiny or huge.
Grid drawGrid(std::uint64_t scene) {
  Draw draw(scene, "grid");
  Grid grid;
  for (int axis = 0; axis < 3; ++axis) grid.dims[axis] = draw.integer(1, 6);
  const double size = draw.chance(0.2) ? draw.decades(1e-3, 1e3) : 1;
  glm::dvec3 spacing(size);
  if (draw.chance(0.5))
    for (int axis = 0; axis < 3; ++axis) spacing[axis] *= draw.decades(0.3, 3);
  if (draw.chance(0.05)) spacing[draw.integer(0, 2)] *= 20;
  glm::dmat3 axes(1);
  if (draw.chance(0.25)) axes = rotation(draw);
  if (draw.chance(0.1)) axes[0] = -axes[0];
  if (draw.chance(0.1)) axes[1] += 0.4 * axes[0];
  const double far = draw.chance(0.1) ? 1e4 : 3;
  const glm::dvec3 origin = draw.chance(0.5) ? glm::dvec3(0) : size * draw.vector(-far, far);
  // As floats, because a NIfTI header holds floats.
  for (int row = 0; row < 3; ++row) {
    for (int axis = 0; axis < 3; ++axis)
      grid.worldFromVoxel[axis][row] = asFloat(spacing[axis] * axes[axis][row]);
    grid.worldFromVoxel[3][row] = asFloat(origin[row]);
  }
  return grid;
}

/// Values in [0, 1] in patterns that are difficult: equal neighbours, ramps, extremes.
std::vector<double> drawPattern(Draw& draw, const glm::ivec3& dims) {
  const std::size_t count = std::size_t(dims.x * dims.y * dims.z);
  std::vector<double> values(count);
  const int kind = draw.integer(0, 9);
  const double constant = draw.uniform();
  const int levels = draw.integer(2, 4);
  const glm::dvec3 slope = draw.vector(-1, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 at(int(i) % dims.x, int(i) / dims.x % dims.y, int(i) / (dims.x * dims.y));
    if (kind == 0)
      values[i] = constant;
    else if (kind <= 2)  // few values
      values[i] = double(draw.integer(0, levels - 1)) / double(levels - 1);
    else if (kind == 3)  // a ramp
      values[i] = 0.5 + glm::dot(slope, at / glm::dvec3(dims) - 0.5) / 2;
    else
      values[i] = draw.uniform();
  }
  return values;
}

template <class T>
void fillIntegers(Draw& draw, const std::vector<double>& pattern, ChannelSource* channel) {
  constexpr double kLeast = std::numeric_limits<T>::min(), kMost = std::numeric_limits<T>::max();
  double lo = kLeast, hi = kMost;
  if (draw.chance(0.3)) {
    lo = std::floor(draw.between(kLeast, kMost - 20));
    hi = std::ceil(draw.between(lo, kMost));
  }
  channel->voxels = VoxelBuffer(scalarTypeOf<T>, pattern.size());
  const auto voxels = channel->voxels.as<T>();
  for (std::size_t i = 0; i < pattern.size(); ++i) voxels[i] = T(std::lround(lo + (hi - lo) * pattern[i]));
}

void fillFloats(Draw& draw, const std::vector<double>& pattern, ChannelSource* channel) {
  const double size = draw.chance(0.3) ? draw.decades(1e-6, 1e6) : 1;
  const double offset = draw.chance(0.4) ? size * draw.between(-200, 200) : 0;
  const double bad = draw.chance(0.25) ? draw.between(0, 0.2) : 0;
  channel->voxels = VoxelBuffer(ScalarType::f32, pattern.size());
  const auto voxels = channel->voxels.as<float>();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    voxels[i] = float(offset + size * pattern[i]);
    if (draw.chance(bad))
      voxels[i] = draw.chance(0.6)   ? std::numeric_limits<float>::quiet_NaN()
                  : draw.chance(0.5) ? kInfinity
                                     : -kInfinity;
  }
}

ChannelSource drawChannel(std::uint64_t scene, int number, const glm::ivec3& dims) {
  Draw draw(scene, "voxels of channel " + std::to_string(number));
  // Channels with the same field have equal values, which matters where their extinctions are compared.
  Draw pattern = draw.chance(0.15) ? Draw(scene, "shared pattern") : draw;
  const std::vector<double> values = drawPattern(pattern, dims);
  ChannelSource channel;
  const int type = draw.integer(0, 3);
  if (type == 0) fillIntegers<std::uint8_t>(draw, values, &channel);
  if (type == 1) fillIntegers<std::uint16_t>(draw, values, &channel);
  if (type == 2) fillIntegers<std::int16_t>(draw, values, &channel);
  if (type == 3) fillFloats(draw, values, &channel);
  if (draw.chance(0.25)) {
    channel.slope = asFloat(draw.between(-3, 3));
    if (channel.slope == 0) channel.slope = 1;
    channel.intercept = asFloat(draw.between(-500, 500));
  }
  channel.name = "channel_" + std::to_string(number);
  return channel;
}

template <class T>
void put(std::array<char, 352>* header, std::size_t offset, T value) {
  std::memcpy(header->data() + offset, &value, sizeof value);
}

}  // namespace

VolumeSource drawVolume(std::uint64_t scene) {
  VolumeSource source{drawGrid(scene), {}};
  Draw draw(scene, "channels");
  const int count = draw.integer(1, 4);
  for (int n = 0; n < count; ++n) source.channels.push_back(drawChannel(scene, n, source.grid.dims));
  return source;
}

std::string describe(const VolumeSource& source) {
  std::ostringstream text;
  const glm::ivec3& d = source.grid.dims;
  const glm::dvec3 s = source.grid.spacing();
  text << d.x << "x" << d.y << "x" << d.z << " voxels of " << s.x << "x" << s.y << "x" << s.z << ",";
  for (const ChannelSource& channel : source.channels) {
    text << " " << nameOf(channel.voxels.type());
    if (channel.voxels.type() == ScalarType::f32)
      for (const float v : channel.voxels.as<float>())
        if (!std::isfinite(v)) {
          text << " (holes)";
          break;
        }
  }
  return text.str();
}

std::vector<std::filesystem::path> writeVolume(const VolumeSource& source,
                                               const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (std::size_t n = 0; n < source.channels.size(); ++n) {
    const ChannelSource& channel = source.channels[n];
    std::array<char, 352> header{};
    put(&header, 0, std::int32_t(348));
    put(&header, 40, std::int16_t(3));
    for (int axis = 0; axis < 3; ++axis) {
      put(&header, std::size_t(42 + 2 * axis), std::int16_t(source.grid.dims[axis]));
      put(&header, std::size_t(80 + 4 * axis), float(source.grid.spacing()[axis]));
    }
    constexpr std::array<std::int16_t, 4> kTypes{2, 512, 4, 16};  // u8, u16, i16, f32
    put(&header, 70, kTypes[std::size_t(channel.voxels.type())]);
    put(&header, 72, std::int16_t(8 * sizeBytes(channel.voxels.type())));
    put(&header, 108, 352.0f);
    put(&header, 112, float(channel.slope));
    put(&header, 116, float(channel.intercept));
    put(&header, 254, std::int16_t(1));
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        put(&header, std::size_t(280 + 4 * (4 * row + column)),
            float(source.grid.worldFromVoxel[column][row]));
    std::memcpy(header.data() + 344, "n+1", 4);
    paths.push_back(folder / ("channel_" + std::to_string(n) + ".nii"));
    std::ofstream file(paths.back(), std::ios::binary);
    file.write(header.data(), std::streamsize(header.size()));
    file.write(reinterpret_cast<const char*>(channel.voxels.data()),
               std::streamsize(channel.voxels.sizeBytes()));
  }
  return paths;
}

}  // namespace scolopax::random_scenes
