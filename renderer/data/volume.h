// SPDX-License-Identifier: Apache-2.0
// A multi-channel volume in memory. Comes from io/ or generate/; macrocells, kernels and the
// reference read it. Immutable once built: sessions share it as shared_ptr<const Volume>.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "renderer/core/scalar_type.h"
#include "renderer/data/histogram.h"

namespace scolopax {

/// Number of all voxels, or cells, of a grid with so many along each axis.
constexpr std::size_t countOf(const glm::ivec3& size) {
  return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
}

/// The most voxels along an axis. Kernels find voxels with floats, which have every whole number up to 2^24.
inline constexpr int kMaxVolumeSide = 1 << 24;

/// Regular grid. Voxel centre (i,j,k), x fastest, lies at worldFromVoxel * (i,j,k,1) in world units.
/// The box reaches half a voxel beyond the outer centres.
struct Grid {
  glm::ivec3 dims{1};              ///< voxels per axis, each from 1 to kMaxVolumeSide
  glm::dmat4 worldFromVoxel{1.0};  ///< affine, not singular
  std::size_t voxelCount() const { return countOf(dims); }
  /// Lengths of one voxel step along each axis, world units.
  glm::dvec3 spacing() const;
  double smallestSpacing() const;
  /// Converts changes per voxel step to gradients in world space, per smallest spacing.
  glm::dmat3 gradientFromVoxel() const;
  /// Length of the box's longest diagonal, world units.
  double diagonal() const;
};

/// Throws Error(badInput) if the grid is empty, singular or not finite, Error(tooLarge) if it is longer than
/// kMaxVolumeSide.
void checkGrid(const Grid& grid);

/// Same dims, and affines that agree within 1e-4 voxel over the whole box.
bool sameGrid(const Grid& a, const Grid& b);

/// Readable bytes after the last voxel, so that a processor may read a few voxels at once.
inline constexpr std::size_t kVoxelPadding = 16;

/// Owner of raw voxel memory: uninitialised on creation, move-only.
class VoxelBuffer {
 public:
  VoxelBuffer() = default;
  /// Throws Error(tooLarge) if the memory cannot be allocated.
  VoxelBuffer(ScalarType type, std::size_t count);
  ScalarType type() const { return type_; }
  std::size_t count() const { return count_; }
  std::size_t sizeBytes() const { return count_ * scolopax::sizeBytes(type_); }
  std::byte* data() { return bytes_.get(); }
  const std::byte* data() const { return bytes_.get(); }
  /// The voxels as their own type; T must be the type of the buffer.
  template <class T>
  std::span<T> as() {
    return {reinterpret_cast<T*>(bytes_.get()), count_};
  }
  template <class T>
  std::span<const T> as() const {
    return {reinterpret_cast<const T*>(bytes_.get()), count_};
  }

  /// The same bytes as voxels of another type of the same size.
  VoxelBuffer reinterpretedAs(ScalarType type) &&;
  /// Gives the memory of the voxels [first, last) back to the system, in whole pages. Their values are lost.
  void release(std::size_t first, std::size_t last);

 private:
  ScalarType type_ = ScalarType::u8;
  std::size_t count_ = 0;
  std::unique_ptr<std::byte[]> bytes_;
};

struct ValueRange {
  double lo, hi;  ///< data units, lo < hi
};

/// How a file says that a channel is to be shown.
struct StatedLook {
  std::optional<std::array<std::uint8_t, 3>> color;  ///< sRGB
  std::optional<ValueRange> window;
  bool labels = false;  ///< the values are labels, not quantities
};

/// The voxels of one channel as type T; voxel i lies i * stride elements after the first.
template <class T>
struct StridedVoxels {
  const T* first;
  std::size_t stride, count;
  const T& operator[](std::size_t i) const { return first[i * stride]; }
  std::size_t size() const { return count; }
};

/// One channel's voxels in a volume. Channels of one type are interleaved, so that a fetch of several
/// channels, or of one that a tracker draws at random, finds them side by side (measured by
/// tests/bench/layout.cpp). Borrows.
class VoxelView {
 public:
  VoxelView() = default;
  /// `lane`: which of the `stride` channels of `buffer`.
  VoxelView(const VoxelBuffer& buffer, std::size_t lane, std::size_t stride)
      : base_(buffer.data()),
        type_(buffer.type()),
        lane_(lane),
        stride_(stride),
        count_(buffer.count() / stride) {}
  ScalarType type() const { return type_; }
  std::size_t count() const { return count_; }
  std::size_t lane() const { return lane_; }
  std::size_t stride() const { return stride_; }
  /// Voxel 0 of lane 0.
  const std::byte* base() const { return base_; }
  /// T must be the type of the voxels.
  template <class T>
  StridedVoxels<T> as() const {
    return {reinterpret_cast<const T*>(base_) + lane_, stride_, count_};
  }

 private:
  const std::byte* base_ = nullptr;
  ScalarType type_ = ScalarType::u8;
  std::size_t lane_ = 0, stride_ = 1, count_ = 0;
};

/// What a loader hands over for one channel. Data value = slope * stored + intercept.
struct ChannelSource {
  std::string name;  ///< "" lets the volume name it "channel i"
  std::string unit;
  VoxelBuffer voxels;
  double slope = 1.0;
  double intercept = 0.0;
  StatedLook look;
};

/// One channel, with what was measured once when it was loaded, but without its voxels.
struct ChannelFacts {
  std::string name;
  std::string unit;
  ScalarType type = ScalarType::u8;
  double slope = 1.0;  ///< data value = slope * stored + intercept; slope != 0
  double intercept = 0.0;
  Histogram histogram;  ///< over data values, finite voxels only
  StatedLook look;
};

struct Channel : ChannelFacts {
  VoxelView voxels;
};

/// What is known of a volume without its voxels: enough to choose how it looks.
struct VolumeFacts {
  Grid grid;
  std::vector<ChannelFacts> channels;
};

class Volume {
 public:
  /// Measures every channel. Throws Error(badInput) if a channel's size is not the grid's, its slope is 0,
  /// its slope or intercept is not finite or too large, there is no channel or more than kMaxChannels, or the
  /// grid is empty, singular or not finite. Throws Error(cancelled) once `stop` is requested. Needs little
  /// memory beside the voxels.
  Volume(Grid grid, std::vector<ChannelSource> channels, const std::stop_token& stop = {});
  const Grid& grid() const { return grid_; }
  std::span<const Channel> channels() const { return channels_; }
  VolumeFacts facts() const { return {grid_, {channels_.begin(), channels_.end()}}; }
  /// Of all voxels.
  std::uint64_t sizeBytes() const;

 private:
  Grid grid_;
  std::vector<VoxelBuffer> buffers_;  // one per voxel type
  std::vector<Channel> channels_;
};

inline constexpr int kMaxChannels = 32;

}  // namespace scolopax
