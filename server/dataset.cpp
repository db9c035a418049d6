// SPDX-License-Identifier: Apache-2.0
#include "server/dataset.h"

#include <utility>

#include "protocol/problem.h"
#include "renderer/data/visible_hull.h"

namespace scolopax::server {
namespace {

io::Dataset headersOf(io::LoadedDataset&& loaded) {
  io::Dataset headers;
  headers.id = std::move(loaded.id);
  headers.title = std::move(loaded.title);
  headers.files = std::move(loaded.files);
  headers.levels = {loaded.volume->grid()};
  headers.times = std::move(loaded.times);
  headers.worldUnit = std::move(loaded.worldUnit);
  for (const Channel& channel : loaded.volume->channels())
    headers.channels.push_back({.name = channel.name,
                                .unit = channel.unit,
                                .slope = channel.slope,
                                .intercept = channel.intercept,
                                .look = channel.look});
  return headers;
}

std::size_t finestThatFits(const io::Dataset& headers, std::uint64_t limitBytes) {
  for (std::size_t level = 0; level < headers.levels.size(); ++level)
    if (io::memoryBytes(headers, level) <= limitBytes) return level;
  return 0;
}

}  // namespace

Dataset::Dataset(io::Dataset headers, std::shared_ptr<VolumeCache> cache)
    : headers_(std::make_shared<const io::Dataset>(std::move(headers))),
      level_(finestThatFits(*headers_, cache->limitBytes())),
      cache_(std::move(cache)) {}

Dataset::Dataset(io::LoadedDataset loaded) : pinned_(loaded.volume) {
  headers_ = std::make_shared<const io::Dataset>(headersOf(std::move(loaded)));
  measure(*pinned_, 0);
}

std::size_t Dataset::stepAt(std::uint64_t time) const {
  if (times() > 1 && time >= times())
    throw protocol::ProtocolError(
        422, "/time",
        "time: expected 0 to " + std::to_string(times() - 1) + ", found " + std::to_string(time));
  return stepOf(std::size_t(time));
}

std::uint64_t Dataset::memoryBytes() const {
  return pinned_ ? pinned_->sizeBytes() : io::memoryBytes(*headers_, level_);
}

std::shared_ptr<const DatasetFacts> Dataset::facts() const {
  const std::lock_guard lock(mutex_);
  return facts_;
}

std::shared_ptr<const DatasetFacts> Dataset::factsOrLoad(const std::stop_token& stop,
                                                         std::size_t time) const {
  if (auto known = facts()) return known;
  load(time, stop);
  return facts();
}

std::shared_ptr<const Volume> Dataset::loaded(std::size_t time) const {
  return pinned_ ? pinned_ : cache_->find({this, stepOf(time)});
}

std::shared_ptr<const Volume> Dataset::load(std::size_t time, const std::stop_token& stop) const {
  auto volume = loaded(time);
  if (!volume) volume = cache_->get(wanted(time), stop);
  if (!facts()) measure(*volume, stepOf(time));
  return volume;
}

std::shared_ptr<const Volume> Dataset::lastUsed() const { return pinned_ ? pinned_ : cache_->lastUsed(this); }

bool Dataset::isLoaded() const { return pinned_ || cache_->holdsAny(this); }

std::optional<LoadProgress> Dataset::loading() const {
  return pinned_ ? std::nullopt : cache_->progress(this);
}

VolumeCache::Wanted Dataset::wanted(std::size_t time) const {
  const std::size_t step = stepOf(time);
  return {{this, step},
          headers_->title,
          memoryBytes(),
          [headers = headers_, level = level_, step](const io::LoadOptions& options) {
            return io::loadVolume(*headers, level, step, options);
          }};
}

void Dataset::measure(const Volume& volume, std::size_t time) const {
  auto measured =
      std::make_shared<const DatasetFacts>(DatasetFacts{volume.facts(), buildCoarseMacrocells(volume), time});
  const std::lock_guard lock(mutex_);
  if (!facts_) facts_ = std::move(measured);
}

}  // namespace scolopax::server
