// SPDX-License-Identifier: Apache-2.0
// The voxels of data sets in memory. They are loaded when they are first asked for. When the memory is needed
// for others, the volumes that nobody uses are dropped, the least recently used first.
#pragma once
#include <chrono>
#include <compare>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/io/loading.h"

namespace scolopax::server {

/// A load that is running.
struct LoadProgress {
  std::size_t time = 0;  ///< the step that is loaded
  std::string stage;     ///< "reading", then "measuring"
  std::uint64_t doneBytes = 0, allBytes = 0;
};

/// Every function may be called from any thread.
class VolumeCache {
 public:
  struct Key {
    const void* dataset;
    std::size_t time;
    auto operator<=>(const Key&) const = default;
  };
  using Load = std::function<std::shared_ptr<const Volume>(const io::LoadOptions&)>;
  /// A volume that is asked for, and how to load it.
  struct Wanted {
    Key key;
    std::string title;    ///< begins error messages
    std::uint64_t bytes;  ///< of memory that its voxels need, at most
    Load load;
  };

  /// Time for which a load goes on after the last caller has left: a client whose request has timed out asks
  /// again, and would otherwise make it begin anew each time.
  static constexpr std::chrono::seconds kLinger{10};

  /// `limitBytes`: of all voxels together, also while they are loaded.
  explicit VolumeCache(std::uint64_t limitBytes, io::Warn warn = {},
                       std::chrono::milliseconds linger = kLinger)
      : limit_(limitBytes), warn_(std::move(warn)), linger_(linger) {}
  /// Ends all loads. Nobody may wait for one.
  ~VolumeCache();
  VolumeCache(const VolumeCache&) = delete;
  VolumeCache& operator=(const VolumeCache&) = delete;

  /// The volume if it is in memory, else nullptr. Counts as a use.
  std::shared_ptr<const Volume> find(const Key& key);
  /// Whether it is in memory.
  bool holds(const Key& key) const;
  /// Whether the data set is in memory at any time.
  bool holdsAny(const void* dataset) const { return lastUsed(dataset) != nullptr; }
  /// The volume of the data set, at any time, that was used last; nullptr if none is in memory. Does not
  /// count as a use.
  std::shared_ptr<const Volume> lastUsed(const void* dataset) const;
  /// The volume. Waits until it has been loaded; several callers share one load. When none of them waits any
  /// more, it is cancelled after a while, or at once if another load needs its memory. Throws Error: tooLarge
  /// if it can never fit into the memory, busy if others use the memory now, both before anything is read;
  /// cancelled once `stop` is requested; what `load` throws.
  std::shared_ptr<const Volume> get(const Wanted& wanted, const std::stop_token& stop);
  /// Loads the volume if no use since `since` has to give way to it; otherwise returns nullptr. Throws as
  /// get(), except busy.
  std::shared_ptr<const Volume> getIfRoom(const Wanted& wanted, std::uint64_t since,
                                          const std::stop_token& stop);
  /// The number of uses so far: for getIfRoom().
  std::uint64_t uses() const;
  /// Keeps something alive as long as the volume is in memory.
  void attach(const Key& key, std::shared_ptr<const void> what);

  /// A load of this data set that is running, if any; one that a caller of get() wants before others.
  std::optional<LoadProgress> progress(const void* dataset) const;
  std::uint64_t limitBytes() const { return limit_; }
  /// Of the volumes that are in memory or being loaded.
  std::uint64_t usedBytes() const;
  /// Those who keep volumes without using them now, such as renderers that nobody watches.
  struct Resting {
    std::function<std::vector<const Volume*>()> volumes;  ///< that they keep; one may be named twice
    std::function<bool()> release;                        ///< ends one of them; false if there is none
  };
  /// They are ended one by one before a load is refused, unless all their volumes would not be enough. Both
  /// functions are called with no lock held.
  void setResting(Resting resting);

 private:
  struct Entry {
    std::shared_ptr<const Volume> volume;
    std::uint64_t bytes = 0, lastUse = 0;
    std::shared_ptr<const void> attached = nullptr;
  };
  /// Memory that a load has been promised.
  struct Room {
    VolumeCache* cache;
    std::uint64_t bytes;
    std::uint64_t most;  ///< that the load may use, its promise included
    Room(VolumeCache* owner, std::uint64_t size, std::uint64_t limit)
        : cache(owner), bytes(size), most(limit) {}
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    ~Room();
    void release();  ///< Requires the mutex.
  };

  /// A load on a thread of its own.
  struct Running {
    std::size_t callers = 0;
    bool wanted = false;                           ///< not only in advance
    std::chrono::steady_clock::time_point left{};  ///< when the last caller left
    bool done = false;
    std::shared_ptr<const Volume> volume = {};
    std::exception_ptr failure = {};
    std::jthread thread = {};
  };

  std::shared_ptr<const Volume> wait(const Wanted& wanted, std::uint64_t since, const std::stop_token& stop);
  std::shared_ptr<Running> running(const Wanted& wanted, std::uint64_t since);
  void joinEnded();
  void run(Running& running, const Wanted& wanted, std::uint64_t since, const std::stop_token& stop);
  bool endAbandoned();
  std::unique_ptr<Room> roomFor(const Wanted& wanted, std::uint64_t since);
  bool makeRoom(std::uint64_t bytes, std::uint64_t since, std::vector<Entry>& dropped);
  bool wouldFit(std::uint64_t bytes, const std::vector<const Volume*>& resting) const;
  std::uint64_t held() const;
  std::shared_ptr<const Volume> load(const Wanted& wanted, std::uint64_t since, const std::stop_token& stop);

  const std::uint64_t limit_;
  const io::Warn warn_;
  const std::chrono::milliseconds linger_;
  mutable std::mutex mutex_;             ///< never held while loading
  std::condition_variable_any changed_;  ///< notified when a load ends
  std::map<Key, Entry> entries_;
  std::map<Key, LoadProgress> loads_;
  std::uint64_t promised_ = 0;  ///< bytes of all Rooms
  std::uint64_t uses_ = 0;
  Resting resting_;
  std::map<Key, std::shared_ptr<Running>> running_;
  std::list<std::shared_ptr<Running>> ended_;  ///< whose threads are to be joined
};

}  // namespace scolopax::server
