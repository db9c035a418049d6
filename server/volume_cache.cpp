// SPDX-License-Identifier: Apache-2.0
#include "server/volume_cache.h"

#include <algorithm>
#include <limits>
#include <system_error>
#include <utility>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/core/thread_priority.h"
#include "renderer/core/wait_hooks.h"

namespace scolopax::server {
namespace {

/// A `since` that lets every volume give way that nobody holds.
constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();

/// Within this time, loads end that are to end.
constexpr std::chrono::seconds kEndTime{2};

}  // namespace

VolumeCache::Room::~Room() {
  const std::lock_guard lock(cache->mutex_);
  release();
}

void VolumeCache::Room::release() { cache->promised_ -= std::exchange(bytes, 0); }

std::shared_ptr<const Volume> VolumeCache::find(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry == entries_.end()) return nullptr;
  entry->second.lastUse = ++uses_;
  return entry->second.volume;
}

bool VolumeCache::holds(const Key& key) const {
  const std::lock_guard lock(mutex_);
  return entries_.contains(key);
}

std::shared_ptr<const Volume> VolumeCache::lastUsed(const void* dataset) const {
  const std::lock_guard lock(mutex_);
  const Entry* last = nullptr;
  for (auto entry = entries_.lower_bound({dataset, 0});
       entry != entries_.end() && entry->first.dataset == dataset; ++entry)
    if (!last || entry->second.lastUse > last->lastUse) last = &entry->second;
  return last ? last->volume : nullptr;
}

VolumeCache::~VolumeCache() {
  std::map<Key, std::shared_ptr<Running>> running;
  {
    const std::lock_guard lock(mutex_);
    running = running_;
  }
  for (const auto& [key, load] : running) load->thread.request_stop();
  for (const auto& [key, load] : running) load->thread.join();
}

std::shared_ptr<const Volume> VolumeCache::get(const Wanted& wanted, const std::stop_token& stop) {
  for (bool again = false;; again = true) {
    try {
      return wait(wanted, kAny, stop);
    } catch (const Error& error) {
      // It may have joined a load in advance, which gives way to others, or one that was ending.
      const bool others = error.code() == ErrorCode::busy || error.code() == ErrorCode::cancelled;
      if (again || !others || stop.stop_requested()) throw;
    }
  }
}

std::shared_ptr<const Volume> VolumeCache::getIfRoom(const Wanted& wanted, std::uint64_t since,
                                                     const std::stop_token& stop) {
  try {
    return wait(wanted, since, stop);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::busy) throw;
    return nullptr;
  }
}

/// Returns the volume, and waits for its load if necessary.
std::shared_ptr<const Volume> VolumeCache::wait(const Wanted& wanted, std::uint64_t since,
                                                const std::stop_token& stop) {
  if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
  if (auto volume = find(wanted.key)) return volume;
  joinEnded();
  const Waiting waiting;  // declared first: ends when the mutex is free again
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Running> load = running(wanted, since);
  ++load->callers;
  load->wanted = load->wanted || since == kAny;
  changed_.wait(lock, stop, [&] { return load->done; });
  if (--load->callers == 0) load->left = std::chrono::steady_clock::now();
  if (!load->done) throw Error(ErrorCode::cancelled, "loading was cancelled");
  if (load->failure) std::rethrow_exception(load->failure);
  // What nobody waits for any more must not keep the volume from giving way.
  return load->callers == 0 ? std::exchange(load->volume, nullptr) : load->volume;
}

/// The load of this volume, which is begun unless it is running. A load that nobody waits for ends then, so
/// that there are never more of them than callers and one. Requires the mutex.
std::shared_ptr<VolumeCache::Running> VolumeCache::running(const Wanted& wanted, std::uint64_t since) {
  if (const auto known = running_.find(wanted.key); known != running_.end()) return known->second;
  for (const auto& [key, load] : running_)
    if (load->callers == 0) load->thread.request_stop();
  const auto load = std::make_shared<Running>();
  running_[wanted.key] = load;
  try {
    load->thread = std::jthread([this, own = load.get(), wanted, since](const std::stop_token& ending) {
      if (since != kAny) lowerThreadPriority();
      run(*own, wanted, since, ending);
    });
  } catch (const std::system_error&) {
    running_.erase(wanted.key);
    throw Error(ErrorCode::busy, wanted.title + ": cannot be loaded now: there are too many threads");
  }
  return load;
}

/// Joins the threads of loads that have ended.
void VolumeCache::joinEnded() {
  std::list<std::shared_ptr<Running>> ended;  // destroyed without the mutex, which their threads may need
  const std::lock_guard lock(mutex_);
  ended.swap(ended_);
}

void VolumeCache::run(Running& running, const Wanted& wanted, std::uint64_t since,
                      const std::stop_token& stop) {
  std::shared_ptr<const Volume> volume;
  std::exception_ptr failure;
  try {
    volume = load(wanted, since, stop);
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  if (running.callers > 0) running.volume = std::move(volume);
  running.failure = failure;
  running.done = true;
  const auto own = running_.find(wanted.key);
  ended_.push_back(own->second);
  running_.erase(own);
  changed_.notify_all();
}

/// Asks the loads to end that nobody waits for, and waits for them, though not for long: one may be waiting
/// here, too. Returns whether one has ended.
bool VolumeCache::endAbandoned() {
  std::list<std::shared_ptr<Running>> ending;
  std::unique_lock lock(mutex_);
  for (const auto& [key, load] : running_)
    if (load->callers == 0 && load->thread.get_id() != std::this_thread::get_id()) ending.push_back(load);
  for (const auto& load : ending) load->thread.request_stop();
  const auto isDone = [](const auto& load) { return load->done; };
  changed_.wait_for(lock, kEndTime, [&] { return std::ranges::all_of(ending, isDone); });
  return std::ranges::any_of(ending, isDone);
}

std::shared_ptr<const Volume> VolumeCache::load(const Wanted& wanted, std::uint64_t since,
                                                const std::stop_token& stop) {
  if (auto volume = find(wanted.key)) return volume;
  const auto room = roomFor(wanted, since);
  struct Shown {
    VolumeCache& cache;
    const Key& key;
    Shown(VolumeCache& owner, const Key& shown) : cache(owner), key(shown) {
      const std::lock_guard lock(cache.mutex_);
      cache.loads_[key] = {key.time, "reading", 0, 0};
    }
    Shown(const Shown&) = delete;
    Shown& operator=(const Shown&) = delete;
    ~Shown() {
      const std::lock_guard lock(cache.mutex_);
      cache.loads_.erase(key);
    }
  };
  const Shown shown(*this, wanted.key);
  std::stop_source abandoned;
  const std::stop_callback ending(stop, [&abandoned] { abandoned.request_stop(); });
  const auto report = [&](const io::Progress& now) {
    const std::lock_guard lock(mutex_);
    const Running& own = *running_.at(wanted.key);
    if (own.callers == 0 && std::chrono::steady_clock::now() - own.left >= linger_) abandoned.request_stop();
    loads_[wanted.key] = {wanted.key.time, std::string(now.stage), now.doneBytes, now.allBytes};
  };
  auto volume = wanted.load(
      {.memoryLimitBytes = room->most, .warn = warn_, .progress = report, .stop = abandoned.get_token()});
  const std::lock_guard lock(mutex_);
  room->release();
  entries_[wanted.key] = {volume, volume->sizeBytes(), ++uses_};
  return volume;
}

std::unique_ptr<VolumeCache::Room> VolumeCache::roomFor(const Wanted& wanted, std::uint64_t since) {
  if (wanted.bytes > limit_)
    throw Error(ErrorCode::tooLarge, wanted.title + ": needs " + io::byteCount(wanted.bytes) +
                                         " of memory, expected at most " + io::byteCount(limit_) +
                                         " (--memory)");
  for (;;) {
    Resting resting;
    std::vector<Entry> dropped;  // destroyed without the mutex, as that takes time
    {
      const std::lock_guard lock(mutex_);
      if (makeRoom(wanted.bytes, since, dropped)) {
        promised_ += wanted.bytes;
        return std::make_unique<Room>(this, wanted.bytes, limit_ - held() + wanted.bytes);
      }
      if (since == kAny) resting = resting_;
    }
    if (since == kAny && endAbandoned()) continue;
    if (!resting.release || !wouldFit(wanted.bytes, resting.volumes()) || !resting.release())
      throw Error(ErrorCode::busy, wanted.title + ": needs " + io::byteCount(wanted.bytes) +
                                       " of memory; others use " + io::byteCount(usedBytes()) + " of the " +
                                       io::byteCount(limit_) + " for voxels (--memory)");
  }
}

/// Takes volumes out until so many bytes are free; false, with nothing taken, if that is impossible. Requires
/// the mutex.
bool VolumeCache::makeRoom(std::uint64_t bytes, std::uint64_t since, std::vector<Entry>& dropped) {
  std::uint64_t held = this->held();
  std::vector<std::map<Key, Entry>::iterator> victims;
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    // Only the cache holds it, and only the cache gives it away.
    if (entry->second.volume.use_count() == 1 && entry->second.lastUse < since) victims.push_back(entry);
  std::ranges::sort(victims, {}, [](const auto& entry) { return entry->second.lastUse; });
  auto end = victims.begin();
  for (; held + bytes > limit_ && end != victims.end(); ++end) held -= (*end)->second.bytes;
  if (held + bytes > limit_) return false;
  std::for_each(victims.begin(), end, [&](const auto& entry) {
    dropped.push_back(std::move(entry->second));
    entries_.erase(entry);
  });
  return true;
}

/// Whether so many bytes may be free once these volumes are no longer kept: they may be in use besides.
bool VolumeCache::wouldFit(std::uint64_t bytes, const std::vector<const Volume*>& resting) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t kept = promised_;
  for (const auto& [key, entry] : entries_)
    if (entry.volume.use_count() > 1 && std::ranges::find(resting, entry.volume.get()) == resting.end())
      kept += entry.bytes;
  return kept + bytes <= limit_;
}

/// Requires the mutex.
std::uint64_t VolumeCache::held() const {
  std::uint64_t bytes = promised_;
  for (const auto& [key, entry] : entries_) bytes += entry.bytes;
  return bytes;
}

std::uint64_t VolumeCache::usedBytes() const {
  const std::lock_guard lock(mutex_);
  return held();
}

std::uint64_t VolumeCache::uses() const {
  const std::lock_guard lock(mutex_);
  return uses_;
}

void VolumeCache::attach(const Key& key, std::shared_ptr<const void> what) {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry != entries_.end()) entry->second.attached = std::move(what);
}

std::optional<LoadProgress> VolumeCache::progress(const void* dataset) const {
  const std::lock_guard lock(mutex_);
  std::optional<LoadProgress> inAdvance;
  for (const auto& [key, load] : loads_) {
    if (key.dataset != dataset) continue;
    const auto running = running_.find(key);
    if (running != running_.end() && running->second->wanted) return load;
    inAdvance = load;
  }
  return inAdvance;
}

void VolumeCache::setResting(Resting resting) {
  const std::lock_guard lock(mutex_);
  resting_ = std::move(resting);
}

}  // namespace scolopax::server
