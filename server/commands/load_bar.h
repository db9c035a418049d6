// SPDX-License-Identifier: Apache-2.0
// Shows on a terminal how far loading is, on one line that is redrawn; elsewhere prints nothing.
#pragma once
#include <memory>
#include <mutex>
#include <thread>

#include "renderer/io/loading.h"
#include "server/dataset_store.h"

namespace scolopax {

class LoadBar {
 public:
  LoadBar();
  /// Clears the line.
  ~LoadBar();
  LoadBar(const LoadBar&) = delete;
  LoadBar& operator=(const LoadBar&) = delete;

  /// From any thread.
  void show(std::string_view stage, std::uint64_t doneBytes, std::uint64_t allBytes);
  /// Shows the loads of the store until the bar ends.
  void follow(std::shared_ptr<const server::DatasetStore> store);

 private:
  const bool terminal_;
  std::mutex mutex_;
  bool shown_ = false;
  std::jthread follower_;  // declared last: uses the other members
};

}  // namespace scolopax
