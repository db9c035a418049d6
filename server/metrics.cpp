// SPDX-License-Identifier: Apache-2.0
#include "server/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

namespace scolopax::server {
namespace {

using prometheus::Counter;
using prometheus::Gauge;

}  // namespace

struct Metrics::Impl {
  prometheus::Registry registry;

  Counter& counter(const char* name, const char* help) {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
  }
  Gauge& gauge(const char* name, const char* help) {
    return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
  }

  prometheus::Family<Counter>& requests = prometheus::BuildCounter()
                                              .Name("scolopax_http_requests_total")
                                              .Help("HTTP responses by status")
                                              .Register(registry);
  Counter& sent = counter("scolopax_frames_sent_total", "Frames sent to streams");
  Counter& replaced =
      counter("scolopax_frames_dropped_total", "Frames replaced by a newer one before they were sent");
  Counter& samples = counter("scolopax_samples_total", "Samples rendered, over all pixels");
  Counter& passes = counter("scolopax_passes_total", "Sample passes that ended");
  Counter& cancelled = counter("scolopax_passes_cancelled_total", "Sample passes ended early by an edit");
  Counter& renderSeconds = counter("scolopax_render_seconds_total", "Time spent in sample passes");
  Counter& rebuildSeconds = counter("scolopax_rebuild_seconds_total", "Time spent taking over edited scenes");
  Counter& built = counter("scolopax_builds_total", "Background scene builds that were completed");
  Counter& abandoned =
      counter("scolopax_builds_abandoned_total", "Background scene builds that were cancelled");
  Gauge& sessions = gauge("scolopax_sessions", "Sessions");
  Gauge& clients = gauge("scolopax_clients", "Open streams");
  Gauge& unreadTexts = gauge("scolopax_unread_text_bytes", "Text messages that clients have not read");
  Gauge& requestBodies =
      gauge("scolopax_request_body_bytes", "Request bodies that are being received or handled");
  Gauge& memoryLimit = gauge("scolopax_memory_limit_bytes", "Limit on the memory that requests use");
  prometheus::Family<Gauge>& memory = prometheus::BuildGauge()
                                          .Name("scolopax_memory_bytes")
                                          .Help("Memory that requests use, by kind of use")
                                          .Register(registry);
  Gauge& voxels = gauge("scolopax_voxel_bytes", "Memory of voxels, loaded or being loaded");
  Gauge& voxelLimit = gauge("scolopax_voxel_limit_bytes", "Limit on the memory of voxels");
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {}
Metrics::~Metrics() = default;

void Metrics::requestAnswered(int status) {
  impl_->requests.Add({{"status", std::to_string(status)}}).Increment();
}

void Metrics::passEnded(const PassResult& pass) {
  if (pass.rendered) {
    impl_->passes.Increment();
    impl_->samples.Increment(double(pass.pixels));
    impl_->renderSeconds.Increment(pass.renderSeconds);
  }
  if (pass.cancelled) impl_->cancelled.Increment();
  if (pass.built) impl_->built.Increment();
  if (pass.abandoned) impl_->abandoned.Increment();
  impl_->rebuildSeconds.Increment(pass.rebuildSeconds);
}

void Metrics::framesSent(std::uint64_t sent, std::uint64_t replaced) {
  impl_->sent.Increment(double(sent));
  impl_->replaced.Increment(double(replaced));
}

void Metrics::setSessions(std::size_t count) { impl_->sessions.Set(double(count)); }
void Metrics::setClients(std::size_t count) { impl_->clients.Set(double(count)); }

void Metrics::setUnreadTextBytes(std::size_t bytes) { impl_->unreadTexts.Set(double(bytes)); }
void Metrics::setRequestBodyBytes(std::size_t bytes) { impl_->requestBodies.Set(double(bytes)); }

void Metrics::setMemory(const MemoryBudget& memory) {
  impl_->memoryLimit.Set(double(memory.limit()));
  for (std::size_t i = 0; i < std::size(kMemoryUses); ++i)
    impl_->memory.Add({{"use", std::string(kMemoryUses[i])}}).Set(double(memory.used(MemoryUse(i))));
}

void Metrics::setVolumes(const VolumeCache& volumes) {
  impl_->voxels.Set(double(volumes.usedBytes()));
  impl_->voxelLimit.Set(double(volumes.limitBytes()));
}

std::string Metrics::text() const {
  return prometheus::TextSerializer().Serialize(impl_->registry.Collect());
}

}  // namespace scolopax::server
