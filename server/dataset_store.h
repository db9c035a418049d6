// SPDX-License-Identifier: Apache-2.0
// The data sets named on the command line, loaded once, and what clients may ask about them.
#pragma once
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_histogram.h"
#include "renderer/io/format.h"

namespace scolopax::server {

using Dataset = io::LoadedDataset;

/// Every function may be called from any thread.
class DatasetStore {
 public:
  /// At least one. What is measured later is of `memory`, if that is given.
  explicit DatasetStore(std::vector<Dataset> datasets, std::shared_ptr<MemoryBudget> memory = nullptr);

  const std::shared_ptr<const Dataset>& first() const { return datasets_.front(); }
  /// nullptr when there is none of that id.
  std::shared_ptr<const Dataset> find(std::string_view id) const;
  const std::vector<std::shared_ptr<const Dataset>>& all() const { return datasets_; }

  using Gradients = std::shared_ptr<const GradientHistogram>;
  /// 64 MiB; more than several scenes of 32 channels need at once.
  static constexpr std::size_t kMostGradients = 128;
  /// Of a channel of a data set of the store; nullptr where they are yet to be measured. Throws
  /// ProtocolError(422) when there is no such channel.
  Gradients gradients(const Dataset& dataset, int channel) const;
  /// The same, which waits until they are measured. The last kMostGradients that were asked for are kept.
  /// Throws also Error: cancelled once `stop` is requested, busy and tooLarge where there is no memory.
  Gradients measuredGradients(const Dataset& dataset, int channel, const std::stop_token& stop) const;

 private:
  /// With the mutex held; nullptr where they are not kept.
  Gradients kept(const Dataset& dataset, int channel) const;

  std::vector<std::shared_ptr<const Dataset>> datasets_;
  std::shared_ptr<MemoryBudget> memory_;
  struct Measured {
    const Dataset* dataset;
    int channel;
    Gradients gradients;
  };
  mutable std::mutex mutex_;               ///< never held while measuring
  mutable std::list<Measured> gradients_;  ///< the last asked for in front
};

/// The files to load: each path as it is, or, with a data root, below it. Throws Error when one leaves the
/// root.
std::vector<std::filesystem::path> pathsBelowRoot(const std::vector<std::filesystem::path>& paths,
                                                  const std::filesystem::path& root);

/// Grid and channels of one data set, as GET /datasets/{id} answers.
nlohmann::json describeJson(const Dataset& dataset);
/// 256 bins over the finite values. Throws ProtocolError(422) when there is no such channel.
nlohmann::json histogramJson(const Dataset& dataset, int channel);
/// The same of |gradient|, from 0 on; with `joint` also for every bin of values.
nlohmann::json gradientHistogramJson(const Dataset& dataset, int channel, const GradientHistogram& gradients,
                                     bool joint);
/// Data values of all channels at a voxel position in the box, trilinear between voxel centres as the
/// renderer interpolates; null where a corner is not finite.
nlohmann::json valuesJson(const Volume& volume, const glm::dvec3& voxel);
/// The same at a world point; a channel is null outside the box too.
nlohmann::json probeJson(const Dataset& dataset, double x, double y, double z);

}  // namespace scolopax::server
