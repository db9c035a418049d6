// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_chunks.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "renderer/core/error.h"

namespace scolopax::io {
namespace {

using ZarrIndex = std::vector<std::int64_t>;

/// Part of an array, in voxels.
struct ZarrBox {
  ZarrIndex first, size;
};

std::uint64_t voxelCountOf(const ZarrIndex& shape) {
  std::uint64_t count = 1;
  for (const std::int64_t length : shape) count = saturatingProduct(count, std::uint64_t(length));
  return count;
}

/// Calls f(chunk index, the chunk's box) for every chunk of a shape that meets `wanted`; both boxes are
/// relative to the same voxel.
template <class F>
void forEachChunk(const ZarrBox& wanted, const ZarrIndex& chunkShape, F&& f) {
  const std::size_t axes = chunkShape.size();
  ZarrIndex index(axes), end(axes);
  ZarrBox box{ZarrIndex(axes), chunkShape};
  for (std::size_t i = 0; i < axes; ++i) {
    index[i] = wanted.first[i] / chunkShape[i];
    end[i] = (wanted.first[i] + wanted.size[i] - 1) / chunkShape[i] + 1;
  }
  const ZarrIndex begin = index;
  for (;;) {
    for (std::size_t i = 0; i < axes; ++i) box.first[i] = index[i] * chunkShape[i];
    f(index, box);
    std::size_t axis = axes;
    while (axis > 0 && ++index[axis - 1] == end[axis - 1]) {
      index[axis - 1] = begin[axis - 1];
      --axis;
    }
    if (axis == 0) return;
  }
}

std::uint64_t chunkCountOf(const ZarrBox& wanted, const ZarrIndex& chunkShape) {
  std::uint64_t count = 1;
  for (std::size_t i = 0; i < chunkShape.size(); ++i)
    count = saturatingProduct(count, std::uint64_t((wanted.first[i] + wanted.size[i] - 1) / chunkShape[i] -
                                                   wanted.first[i] / chunkShape[i] + 1));
  return count;
}

class ZarrChunkReader {
 public:
  ZarrChunkReader(const ZarrStore& store, const ZarrArray& array, const ZarrAxes& axes, std::size_t time,
                  const std::vector<std::size_t>& channels, std::vector<ChannelWriter>& writers,
                  Loading& loading)
      : store_(store),
        array_(array),
        axes_(axes),
        time_(time),
        channels_(channels),
        writers_(writers),
        loading_(loading),
        wanted_{ZarrIndex(array.shape.size(), 0), array.shape} {
    if (axes.time) narrow(*axes.time, time, time);
    if (axes.channel) narrow(*axes.channel, channels.front(), channels.back());
  }

  void read() {
    constexpr std::uint64_t kMostChunks = std::uint64_t(1) << 18;
    const std::uint64_t count = chunkCountOf(wanted_, array_.chunks);
    if (count > kMostChunks)
      throw Error(ErrorCode::unsupported, name("") + ": chunks: expected at most " +
                                              std::to_string(kMostChunks) + " in a volume, found " +
                                              std::to_string(count));
    forEachChunk(wanted_, array_.chunks, [&](const ZarrIndex& index, const ZarrBox& box) {
      loading_.checkStop();
      if (!hasWanted(box)) return;
      const std::string key = keyOf(index);
      if (array_.sharding)
        readShard(key, box);
      else
        readChunk(key, box);
    });
    if (!found_) loading_.warn(name("") + ": no chunk is there, so that every voxel has the fill value");
  }

 private:
  void narrow(std::size_t axis, std::size_t first, std::size_t last) {
    wanted_.first[axis] = std::int64_t(first);
    wanted_.size[axis] = std::int64_t(last - first + 1);
  }

  std::string name(const std::string& key) const {
    return store_.shownKey(key.empty() ? array_.keyPrefix : key);
  }

  /// Whether a channel that is to be read lies in the box.
  bool hasWanted(const ZarrBox& box) const {
    return !axes_.channel || std::ranges::any_of(channels_, [&](std::size_t channel) {
      const std::int64_t at = std::int64_t(channel) - box.first[*axes_.channel];
      return at >= 0 && at < box.size[*axes_.channel];
    });
  }

  std::string keyOf(const ZarrIndex& index) const {
    std::string key = array_.keyPrefix;
    for (std::size_t i = 0; i < index.size(); ++i) {
      if (i > 0) key += array_.separator;
      key += std::to_string(index[i]);
    }
    return key;
  }

  std::uint64_t chunkBytes(const ZarrIndex& shape) const {
    return saturatingProduct(voxelCountOf(shape), sizeBytes(array_.type));
  }

  /// For the bytes of a chunk, packed and not, and what lies between.
  void checkChunkMemory(const std::string& key, const ZarrIndex& shape) const {
    loading_.checkMemory(name(key) + ": a chunk", saturatingProduct(2, chunkBytes(shape)));
  }

  void readChunk(const std::string& key, const ZarrBox& box) {
    const std::uint64_t size = chunkBytes(box.size);
    auto packed = store_.get(key, std::min(largestPackedZarrChunk(size), loading_.memoryLimitBytes()));
    if (!packed) return fill(box);
    found_ = true;
    checkChunkMemory(key, box.size);
    write(box, unpackZarrChunk(name(key), std::move(*packed), array_.codecs.packings, size), array_.codecs);
  }

  void readShard(const std::string& key, const ZarrBox& shard) {
    const ZarrSharding& sharding = *array_.sharding;
    constexpr std::uint64_t kMissing = ~std::uint64_t(0);
    const auto index = readShardIndex(key, shard);
    if (index.empty()) return fill(shard);
    found_ = true;
    checkChunkMemory(key, sharding.chunks);
    const std::uint64_t size = chunkBytes(sharding.chunks);
    forEachChunk(wantedIn(shard), sharding.chunks, [&](const ZarrIndex& at, const ZarrBox& relative) {
      loading_.checkStop();
      ZarrBox box = relative;
      std::uint64_t number = 0;
      for (std::size_t i = 0; i < at.size(); ++i) {
        box.first[i] += shard.first[i];
        number = number * std::uint64_t(shard.size[i] / sharding.chunks[i]) + std::uint64_t(at[i]);
      }
      if (!hasWanted(box)) return;
      const auto [offset, packedSize] = index[number];
      if (offset == kMissing && packedSize == kMissing) return fill(box);
      if (packedSize > largestPackedZarrChunk(size))
        throw Error(ErrorCode::badInput, name(key) + ": index: expected at most " +
                                             std::to_string(largestPackedZarrChunk(size)) +
                                             " bytes for a chunk, found " + std::to_string(packedSize));
      auto packed = store_.getRange(key, {.offset = offset, .size = packedSize});
      if (!packed) throw Error(ErrorCode::badInput, name(key) + ": expected a shard, found none any more");
      write(box, unpackZarrChunk(name(key), std::move(*packed), sharding.codecs.packings, size),
            sharding.codecs);
    });
  }

  struct ShardEntry {
    std::uint64_t offset, size;
  };
  /// Where the chunks of a shard lie, in the order of the array's axes; empty if there is no shard.
  std::vector<ShardEntry> readShardIndex(const std::string& key, const ZarrBox& shard) const {
    const ZarrSharding& sharding = *array_.sharding;
    std::uint64_t count = 1;
    for (std::size_t i = 0; i < shard.size.size(); ++i)
      count = saturatingProduct(count, std::uint64_t(shard.size[i] / sharding.chunks[i]));
    const std::uint64_t bytes = saturatingProduct(count, sizeof(ShardEntry));
    const std::uint64_t checksums = sharding.index.packings.size() * sizeof(std::uint32_t);
    loading_.checkMemory(name(key) + ": the index of a shard", saturatingProduct(3, bytes));
    auto packed =
        store_.getRange(key, {.size = saturatingSum(bytes, checksums), .last = !sharding.indexAtStart});
    if (!packed) return {};
    auto unpacked =
        unpackZarrChunk(name(key) + ": index", std::move(*packed), sharding.index.packings, bytes);
    if (sharding.index.bigEndian) swapBytes(unpacked.data(), std::size_t(count) * 2, sizeof(std::uint64_t));
    std::vector<ShardEntry> entries(count);
    std::memcpy(entries.data(), unpacked.data(), unpacked.size());
    return entries;
  }

  /// The wanted part of a shard, relative to it.
  ZarrBox wantedIn(const ZarrBox& shard) const {
    ZarrBox part = wanted_;
    for (std::size_t i = 0; i < part.first.size(); ++i) {
      const std::int64_t first = std::max(wanted_.first[i], shard.first[i]);
      const std::int64_t end = std::min(wanted_.first[i] + wanted_.size[i], shard.first[i] + shard.size[i]);
      part.first[i] = first - shard.first[i];
      part.size[i] = end - first;
    }
    return part;
  }

  void fill(const ZarrBox& box) {
    const ZarrIndex none(box.size.size(), 0);
    writeVoxels(box, array_.fill.data(), none, false);
  }

  void write(const ZarrBox& box, const std::vector<std::byte>& bytes, const ZarrCodecs& codecs) {
    ZarrIndex strides(box.size.size());
    auto stride = std::int64_t(sizeBytes(array_.type));
    for (std::size_t i = codecs.order.size(); i-- > 0; stride *= box.size[codecs.order[i]])
      strides[codecs.order[i]] = stride;
    writeVoxels(box, bytes.data(), strides, codecs.bigEndian);
  }

  void writeVoxels(const ZarrBox& box, const std::byte* bytes, const ZarrIndex& strides, bool bigEndian) {
    glm::ivec3 first(0), size(1);
    std::array<std::ptrdiff_t, 3> spaceStrides{};
    for (int i = 0; i < 3; ++i) {
      const auto axis = axes_.space[std::size_t(i)];
      if (!axis) continue;
      first[i] = int(box.first[*axis]);
      size[i] = int(std::min(box.size[*axis], array_.shape[*axis] - box.first[*axis]));
      spaceStrides[std::size_t(i)] = strides[*axis];
    }
    if (axes_.time) bytes += (std::int64_t(time_) - box.first[*axes_.time]) * strides[*axes_.time];
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      const std::byte* start = bytes;
      if (axes_.channel) {
        const std::int64_t at = std::int64_t(channels_[i]) - box.first[*axes_.channel];
        if (at < 0 || at >= box.size[*axes_.channel]) continue;
        start += at * strides[*axes_.channel];
      }
      writers_[i].writeBox(first, size, start, spaceStrides, bigEndian);
    }
  }

  const ZarrStore& store_;
  const ZarrArray& array_;
  const ZarrAxes& axes_;
  std::size_t time_;
  const std::vector<std::size_t>& channels_;
  std::vector<ChannelWriter>& writers_;
  Loading& loading_;
  bool found_ = false;  ///< a chunk or shard
  ZarrBox wanted_;      ///< the smallest box that holds all that is to be read
};

}  // namespace

void readZarrChunks(const ZarrStore& store, const ZarrArray& array, const ZarrAxes& axes, std::size_t time,
                    const std::vector<std::size_t>& channels, std::vector<ChannelWriter>& writers,
                    Loading& loading) {
  ZarrChunkReader(store, array, axes, time, channels, writers, loading).read();
}

}  // namespace scolopax::io
