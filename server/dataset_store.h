// SPDX-License-Identifier: Apache-2.0
// The data sets that are served, and what has been measured of them. Also makes the answers to requests about
// them.
#pragma once
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_histogram.h"
#include "renderer/data/scene.h"
#include "renderer/io/datasets.h"
#include "server/dataset.h"

namespace scolopax::server {

/// Every function may be called from any thread.
class DatasetStore {
 public:
  /// Data sets whose voxels are loaded into `cache` when they are first needed. There must be at least one:
  /// otherwise throws Error(badInput). Memory for later measurements is charged to `memory`, if given.
  DatasetStore(std::vector<io::Dataset> datasets, std::shared_ptr<VolumeCache> cache,
               std::shared_ptr<MemoryBudget> memory = nullptr);
  /// Data sets that are in memory.
  explicit DatasetStore(std::vector<io::LoadedDataset> datasets,
                        std::shared_ptr<MemoryBudget> memory = nullptr);

  const std::shared_ptr<const Dataset>& first() const { return datasets_.front(); }
  /// nullptr if no data set has this id.
  std::shared_ptr<const Dataset> find(std::string_view id) const;
  const std::vector<std::shared_ptr<const Dataset>>& all() const { return datasets_; }
  /// Null if the data sets stay in memory.
  const std::shared_ptr<VolumeCache>& cache() const { return cache_; }

  using Gradients = std::shared_ptr<const GradientHistogram>;
  /// Number of histograms kept: 64 MiB, enough for several scenes of 32 channels at once.
  static constexpr std::size_t kMaxGradients = 128;
  /// The gradient histogram of a channel of one of the store's data sets, at the time of its facts; nullptr
  /// if it has not been measured. Throws ProtocolError(422) if there is no such channel.
  Gradients gradients(const Dataset& dataset, int channel) const;
  /// The same, but loads the data set and measures the histogram if necessary. The kMaxGradients histograms
  /// requested last are kept.
  /// Also throws Error: cancelled once `stop` is requested, busy and tooLarge if there is not enough memory.
  Gradients measuredGradients(const Dataset& dataset, int channel, const std::stop_token& stop) const;

 private:
  /// nullptr if the histogram is not kept. Requires the mutex.
  Gradients kept(const Dataset& dataset, int channel) const;

  std::vector<std::shared_ptr<const Dataset>> datasets_;
  std::shared_ptr<VolumeCache> cache_;
  std::shared_ptr<MemoryBudget> memory_;
  struct Measured {
    const Dataset* dataset;
    int channel;
    Gradients gradients;
  };
  mutable std::mutex mutex_;               ///< never held while measuring
  mutable std::list<Measured> gradients_;  ///< the most recently requested first
};

/// The files to load: the paths as they are or, with a root, relative to it. Throws Error if a path leads
/// outside the root.
std::vector<std::filesystem::path> pathsBelowRoot(const std::vector<std::filesystem::path>& paths,
                                                  const std::filesystem::path& root);

/// Grid, channels and state of one data set, as in the answer to GET /datasets/{id}. Until it is first
/// loaded, without the ranges of values, and with the types of the files.
nlohmann::json describeJson(const Dataset& dataset);
/// What the headers say.
nlohmann::json describeJson(const io::Dataset& dataset, std::size_t level = 0);
/// Histogram with 256 bins over the finite values. Throws ProtocolError(422) if there is no such channel.
nlohmann::json histogramJson(const VolumeFacts& volume, int channel);
/// The same for |gradient|, beginning at 0; with `joint`, also for every bin of values.
nlohmann::json gradientHistogramJson(const VolumeFacts& volume, int channel,
                                     const GradientHistogram& gradients, bool joint);
/// Data values of all channels at a voxel position inside the box, interpolated as `appearances` (one per
/// channel) say, or trilinearly if there are none; null where a value is not finite.
nlohmann::json valuesJson(const Volume& volume, const glm::dvec3& voxel,
                          std::span<const ChannelAppearance> appearances = {});
/// The same, trilinearly, at a world point. Outside the box all values are null.
nlohmann::json probeJson(const Volume& volume, double x, double y, double z);

}  // namespace scolopax::server
