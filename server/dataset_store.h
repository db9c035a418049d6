// SPDX-License-Identifier: Apache-2.0
// The data sets named on the command line, loaded once, and what clients may ask about them.
#pragma once
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/format.h"

namespace scolopax::server {

using Dataset = io::LoadedDataset;

class DatasetStore {
 public:
  /// At least one.
  explicit DatasetStore(std::vector<Dataset> datasets);

  const std::shared_ptr<const Dataset>& first() const { return datasets_.front(); }
  /// nullptr when there is none of that id.
  std::shared_ptr<const Dataset> find(std::string_view id) const;
  const std::vector<std::shared_ptr<const Dataset>>& all() const { return datasets_; }

 private:
  std::vector<std::shared_ptr<const Dataset>> datasets_;
};

/// The files to load: each path as it is, or, with a data root, below it. Throws Error when one leaves the
/// root.
std::vector<std::filesystem::path> pathsBelowRoot(const std::vector<std::filesystem::path>& paths,
                                                  const std::filesystem::path& root);

/// Grid and channels of one data set, as GET /datasets/{id} answers.
nlohmann::json describeJson(const Dataset& dataset);
/// 256 bins over the finite values. Throws ProtocolError(422) when there is no such channel.
nlohmann::json histogramJson(const Dataset& dataset, int channel);
/// Data values of all channels at a voxel position in the box, trilinear between voxel centres as the
/// renderer interpolates; null where a corner is not finite.
nlohmann::json valuesJson(const Volume& volume, const glm::dvec3& voxel);
/// The same at a world point; a channel is null outside the box too.
nlohmann::json probeJson(const Dataset& dataset, double x, double y, double z);

}  // namespace scolopax::server
