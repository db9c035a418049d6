// SPDX-License-Identifier: Apache-2.0
// One load of voxels: its memory limit, warnings, progress and end. From whoever asks for a load to the
// readers.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>

namespace scolopax::io {

/// Called with one line for each thing that loading changed (a widened or narrowed type, a skipped field).
using Warn = std::function<void(const std::string&)>;

/// The default limit: half of the machine's memory, or 4 GiB if that is unknown.
std::uint64_t defaultMemoryLimitBytes();

struct Progress {
  std::string_view stage;       ///< what is being done: "reading", then "measuring"
  std::uint64_t doneBytes = 0;  ///< of the voxels, unpacked, in the types of the file
  std::uint64_t allBytes = 0;
};

/// What the caller of a load wants.
struct LoadOptions {
  std::uint64_t memoryLimitBytes = defaultMemoryLimitBytes();
  Warn warn = {};
  /// Called at the beginning of every stage and about 256 times while reading, from any thread, but never
  /// from two at once.
  std::function<void(const Progress&)> progress = {};
  std::stop_token stop = {};  ///< once requested, the load throws Error(cancelled) soon
};

/// A load while it runs. Readers get it; every function may be called from any thread.
class Loading {
 public:
  Loading(LoadOptions options, std::uint64_t allBytes);

  /// Passes the line on, once: channels of one file tend to give the same warnings.
  void warn(const std::string& line);
  /// Throws Error(cancelled) once the load is to end. ChannelWriter calls it for every write; a reader that
  /// does long work between writes calls it too.
  void checkStop() const;
  /// Reports that so many bytes more have been read, as ChannelWriter does. Throws like checkStop.
  void advance(std::uint64_t bytes);
  /// Reports that the voxels have been read and `stage` begins.
  void begin(std::string_view stage);
  /// Throws Error(tooLarge), beginning with `what`, unless the memory limit allows so many bytes. For memory
  /// that a reader needs beside the channels, whose own memory has been checked.
  void checkMemory(const std::string& what, std::uint64_t bytes) const;

  std::uint64_t memoryLimitBytes() const { return options_.memoryLimitBytes; }
  const std::stop_token& stop() const { return options_.stop; }

 private:
  void report();

  const LoadOptions options_;
  std::mutex mutex_;
  std::set<std::string> said_;
  Progress progress_{"reading", 0, 0};
  std::uint64_t reportedBytes_ = 0;
};

/// "123 bytes", or "more than 2^64 bytes" for a saturated size.
std::string byteCount(std::uint64_t bytes);

}  // namespace scolopax::io
