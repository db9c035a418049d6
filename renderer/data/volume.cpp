// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/volume.h"

#include <sys/mman.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <new>
#include <span>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/kernel/lanes.h"

namespace scolopax {
namespace {

bool isFinite(const glm::dmat4& m) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      if (!std::isfinite(m[column][row])) return false;
  return true;
}

/// Kernels interpolate in float. What float represents badly is moved, exactly, from the voxels to slope and
/// intercept. A power of two goes to the slope, so that differences of huge values stay finite and spreads of
/// tiny ones stay above the denormals (only denormals beside huge values are rounded). The least value goes
/// to the intercept if the spread is narrow for its distance from zero, so that interpolation between two
/// voxels has the resolution of the spread.
void normalise(VoxelBuffer& buffer, Channel& channel) {
  if (buffer.type() != ScalarType::f32) return;
  const auto voxels = buffer.as<float>();
  float least = kernel::kInfinity, most = -kernel::kInfinity;
  for (const float v : voxels) {
    if (!std::isfinite(v)) continue;
    least = std::min(least, v);
    most = std::max(most, v);
  }
  const float largest = std::max(std::abs(least), std::abs(most));
  if (!(least <= most) || largest == 0) return;
  // Below 2^124 the kernels' differences are finite; tiny values are scaled to about 1.
  const int shift = largest >= 0x1p124f    ? 123 - std::ilogb(largest)
                    : largest <= 0x1p-100f ? -std::ilogb(largest)
                                           : 0;
  if (shift != 0) {
    for (float& v : voxels) v = std::ldexp(v, shift);
    channel.slope = std::ldexp(channel.slope, -shift);
    least = std::ldexp(least, shift);
    most = std::ldexp(most, shift);
  }
  // Within a factor of two of each other, floats have exact differences.
  if (least < most && most - least <= std::abs(least) * 0x1p-8f) {
    for (float& v : voxels) v -= least;
    channel.intercept += channel.slope * double(least);
  }
}

void checkStop(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
}

/// Interleaves the channels of the buffers. Their memory is given back piece by piece, so that little more is
/// needed than for the result.
VoxelBuffer interleave(std::span<VoxelBuffer* const> planes, const std::stop_token& stop) {
  if (planes.size() == 1) return std::move(*planes[0]);
  constexpr std::size_t kPiece = 1 << 21;
  const std::size_t stride = planes.size(), count = planes[0]->count();
  VoxelBuffer mixed(planes[0]->type(), count * stride);
  visitScalarType(mixed.type(), [&](auto zero) {
    using T = decltype(zero);
    const auto to = mixed.as<T>();
    for (std::size_t first = 0; first < count; first += kPiece) {
      checkStop(stop);
      const std::size_t last = std::min(first + kPiece, count);
      tbb::parallel_for(tbb::blocked_range<std::size_t>(first, last, 1 << 14), [&](const auto& range) {
        for (std::size_t lane = 0; lane < stride; ++lane) {
          const auto from = planes[lane]->as<T>();
          for (std::size_t i = range.begin(); i < range.end(); ++i) to[i * stride + lane] = from[i];
        }
      });
      for (VoxelBuffer* plane : planes) plane->release(first, last);
    }
  });
  for (VoxelBuffer* plane : planes) *plane = VoxelBuffer();
  return mixed;
}

}  // namespace

glm::dvec3 Grid::spacing() const {
  const auto& m = worldFromVoxel;
  return {glm::length(glm::dvec3(m[0])), glm::length(glm::dvec3(m[1])), glm::length(glm::dvec3(m[2]))};
}

double Grid::smallestSpacing() const {
  const glm::dvec3 all = spacing();
  return std::min({all.x, all.y, all.z});
}

glm::dmat3 Grid::gradientFromVoxel() const {
  return glm::inverse(glm::transpose(glm::dmat3(worldFromVoxel) / smallestSpacing()));
}

double Grid::diagonal() const {
  const glm::dmat3 m(worldFromVoxel);
  const glm::dvec3 d(dims);
  double longest = 0;
  for (const double sy : {1.0, -1.0})
    for (const double sz : {1.0, -1.0})
      longest = std::max(longest, glm::length(m * (d * glm::dvec3(1, sy, sz))));
  return longest;
}

void checkGrid(const Grid& grid) {
  const std::string found = "found " + std::to_string(grid.dims.x) + "x" + std::to_string(grid.dims.y) + "x" +
                            std::to_string(grid.dims.z);
  if (grid.dims.x < 1 || grid.dims.y < 1 || grid.dims.z < 1)
    throw Error(ErrorCode::badInput, "volume: every dimension must be at least 1, " + found);
  if (grid.dims.x > kMaxVolumeSide || grid.dims.y > kMaxVolumeSide || grid.dims.z > kMaxVolumeSide)
    throw Error(ErrorCode::tooLarge, "volume: expected at most " + std::to_string(kMaxVolumeSide) +
                                         " voxels along an axis, " + found);
  if (!isFinite(grid.worldFromVoxel))
    throw Error(ErrorCode::badInput,
                "volume: the affine from voxels to world has a value that is not finite");
  // Singular relative to the lengths of its columns, so that a scale of 1e-9 is as good as 1.
  const glm::dvec3 spacing = grid.spacing();
  const double product = spacing.x * spacing.y * spacing.z;
  if (!(product > 0) || !(std::abs(glm::determinant(glm::dmat3(grid.worldFromVoxel))) > 1e-6 * product))
    throw Error(ErrorCode::badInput, "volume: the affine from voxels to world is singular");
}

bool sameGrid(const Grid& a, const Grid& b) {
  if (a.dims != b.dims) return false;
  const glm::dmat4 bFromA = glm::inverse(b.worldFromVoxel) * a.worldFromVoxel;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1) * glm::dvec3(a.dims) - 0.5;
    const glm::dvec3 q(bFromA * glm::dvec4(p, 1));
    if (!(glm::length(q - p) <= 1e-4)) return false;
  }
  return true;
}

VoxelBuffer::VoxelBuffer(ScalarType type, std::size_t count) : type_(type), count_(count) {
  try {
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(count * scolopax::sizeBytes(type) + kVoxelPadding);
    std::fill_n(bytes_.get() + count * scolopax::sizeBytes(type), kVoxelPadding, std::byte(0));
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge, "not enough memory for " + std::to_string(count) + " voxels of type " +
                                         std::string(nameOf(type)));
  }
}

VoxelBuffer VoxelBuffer::reinterpretedAs(ScalarType type) && {
  VoxelBuffer result(std::move(*this));
  result.type_ = type;
  return result;
}

void VoxelBuffer::release(std::size_t first, std::size_t last) {
  static const auto pageBytes = std::uintptr_t(::sysconf(_SC_PAGE_SIZE));
  const auto start = reinterpret_cast<std::uintptr_t>(bytes_.get());
  const std::size_t size = scolopax::sizeBytes(type_);
  // The first page may also hold what is before the voxels. Neighbouring pieces share a page, which stays.
  const std::uintptr_t begin = (start + first * size + pageBytes - 1) / pageBytes * pageBytes,
                       end = (start + last * size) / pageBytes * pageBytes;
  if (begin < end) ::madvise(bytes_.get() + (begin - start), end - begin, MADV_DONTNEED);
}

std::uint64_t Volume::sizeBytes() const {
  std::uint64_t bytes = 0;
  for (const VoxelBuffer& buffer : buffers_) bytes += buffer.sizeBytes();
  return bytes;
}

Volume::Volume(Grid grid, std::vector<ChannelSource> sources, const std::stop_token& stop) : grid_(grid) {
  checkGrid(grid_);
  if (sources.empty() || sources.size() > std::size_t(kMaxChannels))
    throw Error(ErrorCode::badInput, "volume: expected 1 to " + std::to_string(kMaxChannels) +
                                         " channels, found " + std::to_string(sources.size()));
  for (std::size_t i = 0; i < sources.size(); ++i) {
    ChannelSource& source = sources[i];
    Channel channel;
    channel.name = source.name.empty() ? "channel " + std::to_string(i) : std::move(source.name);
    channel.unit = std::move(source.unit);
    channel.slope = source.slope;
    channel.intercept = source.intercept;
    if (source.voxels.count() != grid_.voxelCount())
      throw Error(ErrorCode::badInput, "volume: channel '" + channel.name + "' has " +
                                           std::to_string(source.voxels.count()) + " voxels, the grid has " +
                                           std::to_string(grid_.voxelCount()));
    if (!std::isfinite(channel.slope) || channel.slope == 0 || !std::isfinite(channel.intercept))
      throw Error(ErrorCode::badInput, "volume: channel '" + channel.name +
                                           "' needs a finite slope that is not 0 and a finite intercept");
    // Keeps sums and differences of data values finite too.
    const double largestStored = source.voxels.type() == ScalarType::f32 ? 0x1p128 : 0x1p16;
    if (!(std::abs(channel.slope) * largestStored + std::abs(channel.intercept) < 0x1p1000))
      throw Error(ErrorCode::badInput,
                  "volume: channel '" + channel.name + "' needs values below 1e301, found slope " +
                      shortText(channel.slope) + " and intercept " + shortText(channel.intercept));
    channel.type = source.voxels.type();
    channel.look = source.look;
    checkStop(stop);
    normalise(source.voxels, channel);
    channel.histogram = measureHistogram(source.voxels, channel.slope, channel.intercept);
    channels_.push_back(std::move(channel));
  }
  for (const ScalarType type : {ScalarType::u8, ScalarType::u16, ScalarType::i16, ScalarType::f32}) {
    std::vector<VoxelBuffer*> planes;
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < sources.size(); ++i)
      if (sources[i].voxels.count() > 0 && sources[i].voxels.type() == type) {
        planes.push_back(&sources[i].voxels);
        members.push_back(i);
      }
    if (planes.empty()) continue;
    buffers_.push_back(interleave(planes, stop));
    for (std::size_t lane = 0; lane < members.size(); ++lane)
      channels_[members[lane]].voxels = VoxelView(buffers_.back(), lane, members.size());
  }
}

}  // namespace scolopax
