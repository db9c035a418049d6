// SPDX-License-Identifier: Apache-2.0
#include "server/commands/load_bar.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <utility>

namespace scolopax {
namespace {

constexpr int kWidth = 40;

}  // namespace

LoadBar::LoadBar() : terminal_(isatty(STDERR_FILENO) == 1) {}

LoadBar::~LoadBar() {
  follower_ = {};
  if (shown_) fmt::print(stderr, "\r{: <{}}\r", "", kWidth + 40);
}

void LoadBar::show(std::string_view stage, std::uint64_t doneBytes, std::uint64_t allBytes) {
  if (!terminal_) return;
  const std::lock_guard lock(mutex_);
  shown_ = true;
  const double done = allBytes > 0 ? std::min(1.0, double(doneBytes) / double(allBytes)) : 0;
  const int filled = int(done * kWidth);
  fmt::print(stderr, "\r[{:=<{}}{: <{}}] {}, {:.0f} of {:.0f} MB ", "", filled, "", kWidth - filled, stage,
             double(doneBytes) * 1e-6, double(allBytes) * 1e-6);
  std::fflush(stderr);
}

void LoadBar::follow(std::shared_ptr<const server::DatasetStore> store) {
  if (!terminal_) return;
  follower_ = std::jthread([this, store = std::move(store)](const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any ended;
    while (!ended.wait_for(lock, stop, std::chrono::milliseconds(100), [] { return false; })) {
      if (stop.stop_requested()) return;
      for (const auto& dataset : store->all())
        if (const auto load = dataset->loading()) show(load->stage, load->doneBytes, load->allBytes);
    }
  });
}

}  // namespace scolopax
