// SPDX-License-Identifier: Apache-2.0
// Counters for GET /metrics, in Prometheus' text format. Every function may be called from any thread.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "server/progressive_render.h"
#include "server/volume_cache.h"

namespace scolopax::server {

class Metrics {
 public:
  Metrics();
  ~Metrics();
  void requestAnswered(int status);
  void passEnded(const PassResult& pass);
  /// Adds counts of frames since the last call.
  void framesSent(std::uint64_t sent, std::uint64_t replaced);
  void setSessions(std::size_t count);
  void setClients(std::size_t count);
  void setUnreadTextBytes(std::size_t bytes);
  void setRequestBodyBytes(std::size_t bytes);
  void setMemory(const MemoryBudget& memory);
  void setVolumes(const VolumeCache& volumes);
  std::string text() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::server
