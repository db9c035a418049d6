// SPDX-License-Identifier: Apache-2.0
#include "cuda/device_scene.h"

#include <algorithm>
#include <cstring>

#include "cuda/check.h"
#include "cuda/rebuild_totals.h"

namespace scolopax::cuda {
namespace {

/// Of arrays that share a block. Enough for any type, and for coalesced loads.
constexpr std::size_t kAlignment = 256;
/// Larger arrays get a block of their own, so that an edit of another one does not keep them.
constexpr std::size_t kLargeArray = std::size_t{256} << 10;

/// Sets what a kernel computes per macrocell from what is on the device; returns the memory that holds it.
DeviceBytes makeTotals(kernel::MajorantView* majorants, bool active, DeviceMemory& memory) {
  const std::size_t count = countOf(majorants->cells);
  const std::size_t activeBytes = active ? count * sizeof(std::uint32_t) : 0;
  DeviceBytes bytes = memory.allocate(activeBytes + count * sizeof(kernel::TotalCode));
  // The wider ones first, for their alignment.
  auto* const bits = active ? reinterpret_cast<std::uint32_t*>(bytes.get()) : nullptr;
  auto* const totals = reinterpret_cast<kernel::TotalCode*>(bytes.get() + activeBytes);
  check(rebuildTotals(*majorants, totals, bits, nullptr), "starting a kernel");
  check(cudaStreamSynchronize(nullptr), "rebuilding majorants");
  majorants->totals = totals;
  majorants->active = bits;
  return bytes;
}

}  // namespace

/// Collects the arrays of a plan, and uploads those that are new.
class DeviceScene::Upload {
 public:
  Upload(DeviceScene& scene, const DeviceScene* before) : scene_(scene), before_(before) {}

  /// `array` points to device memory after finish().
  template <class T>
  void add(const T** array, std::size_t count) {
    if (!*array || count == 0) {
      *array = nullptr;
      return;
    }
    patches_.push_back(
        {scene_.arrays_.size(), [array](std::byte* device) { *array = reinterpret_cast<const T*>(device); }});
    Array found{*array, count * sizeof(T), nullptr, nullptr};
    if (const Array* same = find(scene_.arrays_, found)) {
      patches_.back().array = std::size_t(same - scene_.arrays_.data());
      return;
    }
    if (const Array* same = before_ ? find(before_->arrays_, found) : nullptr) {
      found.device = same->device;
      found.memory = same->memory;
    }
    scene_.arrays_.push_back(std::move(found));
  }
  template <class Value>
  void add(kernel::CurveView<Value>* curve) {
    if (curve->count == 0) return;
    add(&curve->positions, std::size_t(curve->count));
    add(&curve->values, std::size_t(curve->count));
    add(&curve->buckets, std::size_t(kernel::kCurveBuckets + 1));
  }
  void add(kernel::OpticalCurveView* curve) {
    if (curve->count == 0) return;
    add(&curve->knots, std::size_t(curve->count));
    add(&curve->buckets, std::size_t(kernel::kCurveBuckets + 1));
  }
  void add(kernel::MajorantView* majorants) {
    add(&majorants->intervals, countOf(majorants->cells) * std::size_t(majorants->columns));
    add(&majorants->tables, std::size_t(majorants->tableCount));
    add(&majorants->radii, CellBlocks(majorants->cells).count());
  }

  void finish(DeviceMemory& memory, Uploader& uploader) {
    std::vector<Array*> fresh;
    for (Array& array : scene_.arrays_)
      if (!array.device) fresh.push_back(&array);
    // Small arrays first, all in one block.
    const auto large = std::stable_partition(fresh.begin(), fresh.end(),
                                             [](const Array* array) { return array->bytes < kLargeArray; });
    std::vector<std::size_t> offsets;
    std::size_t bytes = 0;
    for (auto at = fresh.begin(); at != large; ++at) {
      offsets.push_back(bytes);
      bytes += ((*at)->bytes + kAlignment - 1) / kAlignment * kAlignment;
    }
    const DeviceBytes block = memory.allocate(bytes);
    if (block) {
      std::vector<std::byte> all(bytes);
      for (std::size_t i = 0; i < offsets.size(); ++i) {
        std::memcpy(all.data() + offsets[i], fresh[i]->host, fresh[i]->bytes);
        fresh[i]->device = block.get() + offsets[i];
        fresh[i]->memory = block;
      }
      copy(all.data(), block.get(), bytes, uploader);
    }
    for (auto at = large; at != fresh.end(); ++at) {
      Array& array = **at;
      array.memory = memory.allocate(array.bytes);
      array.device = array.memory.get();
      copy(array.host, array.device, array.bytes, uploader);
    }
    for (const Patch& patch : patches_) patch.set(scene_.arrays_[patch.array].device);
  }

  static void copy(const void* host, std::byte* device, std::size_t bytes, Uploader& uploader) {
    uploader.copy(device, bytes, 0, [&](std::byte* piece, std::size_t offset, std::size_t count) {
      std::memcpy(piece, static_cast<const std::byte*>(host) + offset, count);
    });
  }

 private:
  struct Patch {
    std::size_t array;
    std::function<void(std::byte*)> set;
  };
  /// An array with the same bytes. Plans share what an edit does not change, or copy it.
  static const Array* find(const std::vector<Array>& arrays, const Array& wanted) {
    const auto same = [&](const Array& array) {
      return array.bytes == wanted.bytes &&
             (array.host == wanted.host || std::memcmp(array.host, wanted.host, wanted.bytes) == 0);
    };
    const auto found = std::find_if(arrays.begin(), arrays.end(), same);
    return found == arrays.end() ? nullptr : &*found;
  }

  DeviceScene& scene_;
  const DeviceScene* before_;
  std::vector<Patch> patches_;
};

DeviceScene::DeviceScene(std::shared_ptr<const RenderPlan> plan, DeviceVolume::Planes planes,
                         DeviceMemory& memory, Uploader& uploader, const DeviceScene* before)
    : plan_(std::move(plan)), planes_(std::move(planes)), view_(plan_->view()) {
  Upload upload(*this, before);
  std::vector<kernel::ChannelView> channels(view_.channels, view_.channels + view_.channelCount);
  for (int n = 0; n < view_.channelCount; ++n) {
    kernel::ChannelView& channel = channels[std::size_t(n)];
    channel.field.voxels = planes_[std::size_t(n)].get();
    channel.field.lane = 0;
    channel.field.stride = 1;
    upload.add(&channel.opacity);
    upload.add(&channel.color);
    upload.add(&channel.optical);
    upload.add(&channel.factor.curve);
    upload.add(&channel.factor.optical);
    upload.add(&channel.surfaces, std::size_t(channel.surfaceCount));
  }
  upload.add(&view_.majorants);
  if (view_.surfaces) upload.add(&view_.surfaceCells);
  upload.finish(memory, uploader);
  const kernel::SceneView &host = plan_->view(), *old = before ? &before->plan_->view() : nullptr;
  const auto computed = [&](auto which, const DeviceBytes& have) {
    kernel::MajorantView& own = view_.*which;
    // The host's arrays are the same ones if no total has changed.
    if (!have || (old->*which).totals != (host.*which).totals)
      return makeTotals(&own, (host.*which).active, memory);
    own.totals = (before->view_.*which).totals;
    own.active = (before->view_.*which).active;
    return have;
  };
  totals_ = computed(&kernel::SceneView::majorants, before ? before->totals_ : nullptr);
  if (view_.surfaces)
    surfaceTotals_ = computed(&kernel::SceneView::surfaceCells, before ? before->surfaceTotals_ : nullptr);
  const std::size_t bytes = channels.size() * sizeof(kernel::ChannelView);
  channels_ = memory.allocate(bytes);
  if (channels_) Upload::copy(channels.data(), channels_.get(), bytes, uploader);
  view_.channels = reinterpret_cast<const kernel::ChannelView*>(channels_.get());
}

kernel::SceneView DeviceScene::viewOf(const kernel::SceneView& host) const {
  kernel::SceneView view = host;
  view.channels = view_.channels;
  view.majorants = view_.majorants;
  view.surfaceCells = view_.surfaceCells;
  view.cancel = nullptr;
  return view;
}

}  // namespace scolopax::cuda
