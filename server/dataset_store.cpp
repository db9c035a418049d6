// SPDX-License-Identifier: Apache-2.0
#include "server/dataset_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "renderer/data/field_view.h"
#include "renderer/io/formats.h"
#include "server/hex_color.h"

namespace scolopax::server {
namespace {

using nlohmann::json;

/// Throws ProtocolError(422) unless there are more channels than this index.
void checkChannel(int channel, std::size_t count) {
  if (channel < 0 || std::size_t(channel) >= count)
    throw protocol::ProtocolError(
        422, "/channel",
        "expected a channel from 0 to " + std::to_string(count - 1) + ", found " + std::to_string(channel));
}

const ChannelFacts& channelOf(const VolumeFacts& volume, int channel) {
  checkChannel(channel, volume.channels.size());
  return volume.channels[std::size_t(channel)];
}

json list(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

double voxelValue(const Channel& channel, std::size_t index) {
  const double stored = visitScalarType(
      channel.voxels.type(), [&](auto zero) { return double(channel.voxels.as<decltype(zero)>()[index]); });
  return channel.slope * stored + channel.intercept;
}

/// Interpolates trilinearly at a voxel position between the outer voxel centres. In double, because the
/// result is reported as a value of the data; the renderer interpolates in float.
double interpolateTrilinearly(const Channel& channel, const glm::ivec3& dims, const glm::dvec3& voxel) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::size_t index = 0, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = std::floor(voxel[axis]);
      const bool upper = corner >> axis & 1;
      weight *= upper ? voxel[axis] - low : 1 - (voxel[axis] - low);
      index += std::size_t(std::min(int(low) + upper, dims[axis] - 1)) * stride;
      stride *= std::size_t(dims[axis]);
    }
    // Corners with weight 0 are included: as in the renderer, one corner that is not finite makes the sample
    // not finite.
    sum += weight * voxelValue(channel, index);
  }
  return sum;
}

double interpolate(const Channel& channel, const glm::ivec3& dims, const glm::dvec3& voxel,
                   Interpolation interpolation) {
  if (interpolation == Interpolation::trilinear) return interpolateTrilinearly(channel, dims, voxel);
  return channel.slope * double(sampleStored(channel, dims, voxel, interpolation)) + channel.intercept;
}

void throwIfEmpty(const std::vector<std::shared_ptr<const Dataset>>& datasets) {
  if (datasets.empty()) throw Error(ErrorCode::badInput, "expected at least one data set, found none");
}

}  // namespace

DatasetStore::DatasetStore(std::vector<io::Dataset> datasets, std::shared_ptr<VolumeCache> cache,
                           std::shared_ptr<MemoryBudget> memory)
    : cache_(std::move(cache)), memory_(std::move(memory)) {
  for (io::Dataset& dataset : datasets)
    datasets_.push_back(std::make_shared<const Dataset>(std::move(dataset), cache_));
  throwIfEmpty(datasets_);
}

DatasetStore::DatasetStore(std::vector<io::LoadedDataset> datasets, std::shared_ptr<MemoryBudget> memory)
    : memory_(std::move(memory)) {
  for (io::LoadedDataset& dataset : datasets)
    datasets_.push_back(std::make_shared<const Dataset>(std::move(dataset)));
  throwIfEmpty(datasets_);
}

std::shared_ptr<const Dataset> DatasetStore::find(std::string_view id) const {
  const auto found =
      std::find_if(datasets_.begin(), datasets_.end(), [&](const auto& d) { return d->id() == id; });
  return found == datasets_.end() ? nullptr : *found;
}

DatasetStore::Gradients DatasetStore::kept(const Dataset& dataset, int channel) const {
  const auto known = std::find_if(gradients_.begin(), gradients_.end(), [&](const Measured& m) {
    return m.dataset == &dataset && m.channel == channel;
  });
  if (known == gradients_.end()) return nullptr;
  gradients_.splice(gradients_.begin(), gradients_, known);
  return known->gradients;
}

DatasetStore::Gradients DatasetStore::gradients(const Dataset& dataset, int channel) const {
  checkChannel(channel, dataset.headers().channels.size());
  const std::lock_guard lock(mutex_);
  return kept(dataset, channel);
}

namespace {

/// The step of the data set's facts; if its memory is not free because another step is shown, that one.
std::shared_ptr<const Volume> volumeToMeasure(const Dataset& dataset, const std::stop_token& stop) {
  const auto facts = dataset.factsOrLoad(stop);
  try {
    return dataset.load(facts->time, stop);
  } catch (const Error& error) {
    auto shown = error.code() == ErrorCode::busy ? dataset.lastUsed() : nullptr;
    if (!shown) throw;
    return shown;
  }
}

}  // namespace

DatasetStore::Gradients DatasetStore::measuredGradients(const Dataset& dataset, int channel,
                                                        const std::stop_token& stop) const {
  if (Gradients known = gradients(dataset, channel)) return known;
  const auto volume = volumeToMeasure(dataset, stop);
  Gradients measured = sharedGradientHistogram(volume, channel, stop, memory_);
  const std::lock_guard lock(mutex_);
  if (Gradients known = kept(dataset, channel)) return known;  // another thread measured the same
  gradients_.push_front({&dataset, channel, measured});
  if (gradients_.size() > kMaxGradients) gradients_.pop_back();
  return measured;
}

std::vector<std::filesystem::path> pathsBelowRoot(const std::vector<std::filesystem::path>& paths,
                                                  const std::filesystem::path& root) {
  if (root.empty()) return paths;
  std::error_code error;
  const auto base = std::filesystem::canonical(root, error);
  if (error) throw Error(ErrorCode::notFound, "--data-root " + root.string() + ": " + error.message());
  std::vector<std::filesystem::path> below;
  for (const auto& path : paths) {
    if (io::isUrl(path)) {
      below.push_back(path);
      continue;
    }
    // Symbolic links are resolved first, so that none leads outside.
    const auto [file, inner] = io::splitName(base / path);
    const auto whole = std::filesystem::weakly_canonical(file);
    const auto relative = whole.lexically_relative(base);
    if (relative.empty() || *relative.begin() == "..")
      throw Error(ErrorCode::badInput, path.string() + ": expected a file below --data-root " +
                                           base.string() + ", found " + whole.string());
    below.push_back(inner.empty() ? whole : std::filesystem::path(whole.string() + ":" + inner));
  }
  return below;
}

namespace {

json gridJson(const io::Dataset& dataset, const Grid& grid) {
  json description = {
      {"id", dataset.id}, {"title", dataset.title}, {"dims", {grid.dims.x, grid.dims.y, grid.dims.z}}};
  description["worldUnit"] = dataset.worldUnit;
  description["times"] = {
      {"count", dataset.times.count}, {"values", dataset.times.values}, {"unit", dataset.times.unit}};
  description["spacing"] = list(grid.spacing());
  description["diagonal"] = grid.diagonal();
  json matrix = json::array();  // column by column
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix.push_back(grid.worldFromVoxel[column][row]);
  description["worldFromVoxel"] = std::move(matrix);
  json& levels = description["levels"] = json::array();
  for (const Grid& level : dataset.levels)
    levels.push_back(
        {{"dims", {level.dims.x, level.dims.y, level.dims.z}}, {"spacing", list(level.spacing())}});
  return description;
}

/// What the file says of a channel's look is only there if it says it.
json describeChannel(const std::string& name, const std::string& unit, std::string_view type,
                     const StatedLook& look) {
  json channel = {{"name", name}, {"unit", unit}, {"type", type}};
  if (look.color) channel["color"] = hexOf(*look.color);
  if (look.window) channel["window"] = {look.window->lo, look.window->hi};
  if (look.labels) channel["labels"] = true;
  return channel;
}

}  // namespace

json describeJson(const Dataset& dataset) {
  json description = describeJson(dataset.headers(), dataset.level());
  description["memoryBytes"] = dataset.memoryBytes();
  const auto facts = dataset.facts();
  const auto load = dataset.loading();
  description["state"] = load ? "loading" : dataset.isLoaded() ? "loaded" : "stored";
  if (load)
    description["loading"] = {{"time", load->time},
                              {"stage", load->stage},
                              {"doneBytes", load->doneBytes},
                              {"allBytes", load->allBytes}};
  if (!facts) return description;
  json& channels = description["channels"] = json::array();
  for (const ChannelFacts& c : facts->volume.channels) {
    channels.push_back(describeChannel(c.name, c.unit, nameOf(c.type), c.look));
    channels.back()["minimum"] = c.histogram.minimum;
    channels.back()["maximum"] = c.histogram.maximum;
  }
  return description;
}

json describeJson(const io::Dataset& dataset, std::size_t level) {
  json description = gridJson(dataset, dataset.levels[level]);
  description["level"] = level;
  description["memoryBytes"] = io::memoryBytes(dataset, level);
  json& channels = description["channels"] = json::array();
  for (const io::ChannelInfo& c : dataset.channels)
    channels.push_back(describeChannel(c.name, c.unit, io::nameOf(c.type), c.look));
  return description;
}

json histogramJson(const VolumeFacts& volume, int channel) {
  const ChannelFacts& measured = channelOf(volume, channel);
  const Histogram& histogram = measured.histogram;
  return {{"channel", channel},
          {"name", measured.name},
          {"unit", measured.unit},
          {"minimum", histogram.minimum},
          {"maximum", histogram.maximum},
          {"finiteCount", histogram.finiteCount},
          {"nonFiniteCount", histogram.nonFiniteCount},
          {"bins", histogram.bins}};
}

json gradientHistogramJson(const VolumeFacts& volume, int channel, const GradientHistogram& gradients,
                           bool joint) {
  const ChannelFacts& measured = channelOf(volume, channel);
  json answer = {{"channel", channel},
                 {"name", measured.name},
                 {"unit", measured.unit},
                 {"maximum", gradients.maximum},
                 {"finiteCount", gradients.finiteCount},
                 {"nonFiniteCount", gradients.nonFiniteCount},
                 {"bins", gradients.bins()}};
  if (joint) {
    json& rows = answer["joint"] = json::array();
    constexpr auto kBins = std::ptrdiff_t(GradientHistogram::kBins);
    for (auto row = gradients.counts.begin(); row != gradients.counts.end(); row += kBins)
      rows.push_back(std::vector<std::uint64_t>(row, row + kBins));
  }
  return answer;
}

json valuesJson(const Volume& volume, const glm::dvec3& voxel,
                std::span<const ChannelAppearance> appearances) {
  const glm::ivec3 dims = volume.grid().dims;
  const glm::dvec3 inside = glm::min(glm::max(voxel, glm::dvec3(0)), glm::dvec3(dims - 1));
  json values = json::array();
  for (std::size_t i = 0; i < volume.channels().size(); ++i) {
    const auto interpolation =
        i < appearances.size() ? appearances[i].interpolation : Interpolation::trilinear;
    const double value = interpolate(volume.channels()[i], dims, inside, interpolation);
    values.push_back(std::isfinite(value) ? json(value) : json(nullptr));
  }
  return values;
}

json probeJson(const Volume& volume, double x, double y, double z) {
  const Grid& grid = volume.grid();
  const auto voxel = glm::dvec3(glm::inverse(grid.worldFromVoxel) * glm::dvec4(x, y, z, 1));
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis)
    inside = inside && voxel[axis] >= -0.5 && voxel[axis] <= grid.dims[axis] - 0.5;
  json values = inside ? valuesJson(volume, voxel) : json(std::vector<json>(volume.channels().size()));
  return {{"inside", inside}, {"voxel", list(voxel)}, {"values", std::move(values)}};
}

}  // namespace scolopax::server
