// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/array_slabs.h"

#include <algorithm>
#include <cstring>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

using ArrayExtent = std::vector<std::uint64_t>;

constexpr std::uint64_t kArrayPieceBytes = std::uint64_t(16) << 20;

std::uint64_t arrayProduct(const ArrayExtent& extent, std::uint64_t bytes) {
  for (const std::uint64_t side : extent) bytes = saturatingProduct(bytes, side);
  return bytes;
}

/// Whole chunks, as many as fit in a piece, the fastest dimensions first.
ArrayExtent arrayBlock(const ArrayExtent& count, const ArrayExtent& chunk, std::uint64_t numberBytes) {
  ArrayExtent shape(count.size());
  for (std::size_t d = 0; d < count.size(); ++d) shape[d] = std::clamp<std::uint64_t>(chunk[d], 1, count[d]);
  for (std::size_t d = count.size(); d-- > 0;) {
    const std::uint64_t times =
        std::max<std::uint64_t>(1, kArrayPieceBytes / arrayProduct(shape, numberBytes));
    shape[d] = std::min(count[d], saturatingProduct(shape[d], times));
  }
  return shape;
}

/// The same, cut along the slowest dimensions until it is a piece: for large chunks.
ArrayExtent arrayPiece(ArrayExtent shape, std::uint64_t numberBytes) {
  for (std::uint64_t& side : shape) {
    const std::uint64_t rowBytes = arrayProduct(shape, numberBytes) / side;
    side = std::clamp<std::uint64_t>(kArrayPieceBytes / rowBytes, 1, side);
  }
  return shape;
}

/// Calls use(first, count) for every box of `shape` in a region, the last dimension fastest.
template <class Use>
void forEachArrayBox(const ArrayExtent& regionFirst, const ArrayExtent& regionCount, const ArrayExtent& shape,
                     Use&& use) {
  ArrayExtent at(shape.size(), 0), first(shape.size()), count(shape.size());
  for (;;) {
    for (std::size_t d = 0; d < shape.size(); ++d) {
      first[d] = regionFirst[d] + at[d];
      count[d] = std::min(shape[d], regionCount[d] - at[d]);
    }
    use(first, count);
    std::size_t d = shape.size();
    for (; d-- > 0; at[d] = 0) {
      at[d] += shape[d];
      if (at[d] < regionCount[d]) break;
    }
    if (d == std::size_t(-1)) return;
  }
}

/// What must be unpacked for a slab, at most: chunks may reach into times and channels that are not wanted.
std::uint64_t arrayUnpackedBytes(const ArraySlab& slab) {
  constexpr std::uint64_t kMostTimes = 64;
  std::uint64_t times = 1;
  for (std::size_t d = 0; d < slab.dims.size(); ++d)
    if (slab.count[d] == 1) times = saturatingProduct(times, slab.dims[d]);
  return saturatingProduct(arrayProduct(slab.count, sizeBytes(slab.type)), std::min(times, kMostTimes));
}

/// In the child: sends an index, the box's first and count, and its numbers.
void sendArraySlab(const Sender& sender, std::uint64_t index, const ArraySlab& slab, const OpenArray& array) {
  const std::uint64_t numberBytes = sizeBytes(slab.type);
  const ArrayExtent block = arrayBlock(slab.count, array.chunk, numberBytes);
  const ArrayExtent piece = arrayPiece(block, numberBytes);
  std::vector<std::byte> bytes(std::size_t(arrayProduct(piece, numberBytes)));
  forEachArrayBox(
      slab.first, slab.count, block, [&](const ArrayExtent& blockFirst, const ArrayExtent& blockCount) {
        forEachArrayBox(
            blockFirst, blockCount, piece, [&](const ArrayExtent& first, const ArrayExtent& count) {
              array.read(first, count, bytes.data());
              sender.send(
                  {std::as_bytes(std::span(&index, 1)), std::as_bytes(std::span(first)),
                   std::as_bytes(std::span(count)),
                   std::span<const std::byte>(bytes).first(std::size_t(arrayProduct(count, numberBytes)))});
            });
      });
}

/// Takes one number off the front of a message.
std::uint64_t takeArrayNumber(std::span<const std::byte>& bytes) {
  std::uint64_t number = 0;
  if (bytes.size() < sizeof(number)) failBadInput("expected more bytes from the library's process");
  std::memcpy(&number, bytes.data(), sizeof(number));
  bytes = bytes.subspan(sizeof(number));
  return number;
}

/// The box of a message that follows the slab's index. The child may be damaged, so all is checked.
ArrayBox arrayBoxOf(const std::string& file, const ArraySlab& slab, std::span<const std::byte> message) {
  const std::size_t rank = slab.dims.size();
  ArrayExtent first(rank), count(rank);
  for (std::uint64_t& value : first) value = takeArrayNumber(message);
  for (std::uint64_t& value : count) value = takeArrayNumber(message);
  std::uint64_t bytes = sizeBytes(slab.type);
  std::vector<std::ptrdiff_t> strides(rank);
  for (std::size_t d = rank; d-- > 0;) {
    strides[d] = std::ptrdiff_t(bytes);
    const std::uint64_t end = saturatingSum(first[d], count[d]);
    if (first[d] < slab.first[d] || end > slab.first[d] + slab.count[d] || count[d] == 0)
      failBadInput(file + ": is damaged (its library crashed)");
    bytes = saturatingProduct(bytes, count[d]);
  }
  if (bytes != message.size()) failBadInput(file + ": is damaged (its library crashed)");
  ArrayBox box{glm::ivec3(0), glm::ivec3(1), {}, message};
  for (int axis = 0; axis < 3; ++axis) {
    if (slab.axes[std::size_t(axis)] < 0) continue;
    const auto d = std::size_t(slab.axes[std::size_t(axis)]);
    box.first[axis] = int(first[d] - slab.first[d]);
    box.size[axis] = int(count[d]);
    box.strideBytes[std::size_t(axis)] = strides[d];
  }
  return box;
}

}  // namespace

ArraySlab slabOf(const ArrayNode& node, std::string_view roles, std::size_t time, std::size_t channel) {
  ArraySlab slab{node.path, node.type.value_or(StoredType::f64), node.chunkBytes, node.dims};
  for (std::size_t d = 0; d < node.dims.size(); ++d) {
    const char role = roles[d];
    const std::size_t axis = std::string_view("xyz").find(role);
    const bool spatial = axis != std::string_view::npos;
    if (spatial) slab.axes[axis] = int(d);
    slab.first.push_back(role == 't' ? time : role == 'c' ? channel : 0);
    slab.count.push_back(spatial ? node.dims[d] : 1);
  }
  return slab;
}

std::uint64_t lengthOf(const ArrayNode& node, std::string_view roles, char role) {
  const std::size_t d = roles.find(role);
  return d < node.dims.size() ? node.dims[d] : 1;
}

glm::ivec3 dimsOf(const std::string& where, const ArrayNode& node, std::string_view roles) {
  const auto length = [&](char role) {
    return std::int64_t(std::min<std::uint64_t>(lengthOf(node, roles, role), std::uint64_t(1) << 62));
  };
  return checkedDims(where, length('x'), length('y'), length('z'));
}

void readSlabs(const OpenArrayFile& open, const fs::path& path, const std::vector<ArraySlab>& slabs,
               Loading& loading, const std::function<void(std::size_t slab, const ArrayBox&)>& take) {
  const std::string file = shown(path);
  std::uint64_t chunkBytes = 0, bytes = 0;
  for (const ArraySlab& slab : slabs) {
    chunkBytes = std::max(chunkBytes, slab.chunkBytes);
    bytes = saturatingSum(bytes, arrayUnpackedBytes(slab));
  }
  // Unpacked, and once more while it is unpacked.
  loading.checkMemory(file + ": a chunk", saturatingProduct(2, chunkBytes));
  ApartLimits limits;
  limits.memoryBytes = saturatingSum(limits.memoryBytes, saturatingProduct(3, chunkBytes));
  limits.computing = std::chrono::seconds(8 + std::min<std::uint64_t>(bytes >> 23, 1'000'000));  // 8 MiB/s
  const auto work = [&](const Sender& sender) {
    const OpenArrays openArray = open(path);
    for (std::size_t i = 0; i < slabs.size(); ++i) sendArraySlab(sender, i, slabs[i], openArray(slabs[i]));
  };
  const auto receive = [&](std::span<const std::byte> message) {
    const std::uint64_t index = takeArrayNumber(message);
    if (index >= slabs.size()) failBadInput(file + ": is damaged (its library crashed)");
    take(std::size_t(index), arrayBoxOf(file, slabs[std::size_t(index)], message));
  };
  runApart(file, limits, loading.stop(), work,
           {receive, [&](const std::string& line) { loading.warn(line); }});
}

std::vector<VoxelBuffer> readSlabs(const OpenArrayFile& open, const fs::path& path,
                                   const std::vector<ArraySlab>& slabs, const VolumeInfo& volume,
                                   const Part& part, Loading& loading) {
  auto writers = makeWriters(shown(path), volume, part, loading);
  readSlabs(open, path, slabs, loading, [&](std::size_t i, const ArrayBox& box) {
    if (!slabs[i].convert) {
      writers[i].writeBox(box.first, box.size, box.bytes.data(), box.strideBytes);
      return;
    }
    const std::vector<float> values = slabs[i].convert(box);
    std::array<std::ptrdiff_t, 3> strides = box.strideBytes;
    for (std::ptrdiff_t& stride : strides)
      stride = stride / std::ptrdiff_t(sizeBytes(slabs[i].type)) * std::ptrdiff_t(sizeof(float));
    writers[i].writeBox(box.first, box.size, reinterpret_cast<const std::byte*>(values.data()), strides);
  });
  return takeAll(writers);
}

}  // namespace scolopax::io
