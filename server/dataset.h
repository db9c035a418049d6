// SPDX-License-Identifier: Apache-2.0
// A data set that is served: what its headers say, what was measured when it was first loaded, and its
// voxels, at any of its times, on request.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/volume.h"
#include "renderer/io/datasets.h"
#include "server/volume_cache.h"

namespace scolopax::server {

/// What stays in memory when the voxels go. It is that of the step that was loaded first, so that ranges and
/// automatic values do not change with the time.
struct DatasetFacts {
  VolumeFacts volume;
  MacrocellGrid coarse;  ///< for visibleHull()
  std::size_t time = 0;
};

/// Every function may be called from any thread.
class Dataset {
 public:
  /// Voxels come from files, at the finest level that fits into the cache, or at level 0 if none fits.
  Dataset(io::Dataset headers, std::shared_ptr<VolumeCache> cache);
  /// Voxels that are in memory and stay there, the same at all times.
  explicit Dataset(io::LoadedDataset loaded);

  const std::string& id() const { return headers_->id; }
  const std::string& title() const { return headers_->title; }
  const io::Dataset& headers() const { return *headers_; }
  std::size_t level() const { return level_; }
  const Grid& grid() const { return headers_->levels[level_]; }
  std::size_t times() const { return headers_->times.count; }
  /// The step that is shown at a scene's `time`: a data set of a single step is the same at all times, so
  /// that one can change to it and back. Throws ProtocolError(422) at /time if there is no such step.
  std::size_t stepAt(std::uint64_t time) const;
  /// Memory that the voxels of one time need, at most.
  std::uint64_t memoryBytes() const;

  /// nullptr until a step has been loaded.
  std::shared_ptr<const DatasetFacts> facts() const;
  /// Loads a step if none has been loaded. Throws as load().
  std::shared_ptr<const DatasetFacts> factsOrLoad(const std::stop_token& stop, std::size_t time = 0) const;
  /// The voxels if they are in memory, else nullptr.
  std::shared_ptr<const Volume> loaded(std::size_t time) const;
  /// The voxels of the time that was used last, if any are in memory.
  std::shared_ptr<const Volume> lastUsed() const;
  /// Whether voxels of any time are in memory. Does not count as a use.
  bool isLoaded() const;
  /// The voxels. Waits until they have been loaded. Throws as VolumeCache::get().
  std::shared_ptr<const Volume> load(std::size_t time, const std::stop_token& stop = {}) const;
  std::optional<LoadProgress> loading() const;

  /// The cache, and what it needs to load a step; for Prefetch. The cache is null for voxels that stay.
  const std::shared_ptr<VolumeCache>& cache() const { return cache_; }
  VolumeCache::Wanted wanted(std::size_t time) const;

 private:
  std::size_t stepOf(std::size_t time) const { return headers_->times.count == 1 ? 0 : time; }
  void measure(const Volume& volume, std::size_t time) const;

  std::shared_ptr<const io::Dataset> headers_;  ///< shared with loads, which may outlive this
  std::size_t level_ = 0;
  std::shared_ptr<VolumeCache> cache_;
  std::shared_ptr<const Volume> pinned_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const DatasetFacts> facts_;
};

}  // namespace scolopax::server
