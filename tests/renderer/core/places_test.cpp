// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/core/shared_builds.h"
#include "renderer/data/measuring.h"

namespace scolopax {
namespace {

TEST(Places, AreGivenInTheOrderInWhichTheyAreAskedFor) {
  Places places(1);
  std::vector<int> order;  // guarded by the place
  std::optional<Places::Place> first(std::in_place, places, std::stop_token());
  std::vector<std::jthread> threads;
  for (int i = 0; i < 5; ++i) {
    threads.emplace_back([&, i] {
      const Places::Place place(places, {});
      order.push_back(i);
    });
    while (places.waiting() <= std::size_t(i)) std::this_thread::yield();
  }
  first.reset();
  threads.clear();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(Places, AreNotWaitedForAnyLongerOnceTheStopIsRequested) {
  Places places(1);
  std::optional<Places::Place> first(std::in_place, places, std::stop_token());
  std::stop_source stop;
  bool got = false;
  {
    const std::jthread leaving([&] { EXPECT_THROW(Places::Place(places, stop.get_token()), Error); });
    while (places.waiting() < 1) std::this_thread::yield();
    const std::jthread staying([&] {
      const Places::Place place(places, {});
      got = true;
    });
    while (places.waiting() < 2) std::this_thread::yield();
    stop.request_stop();
    while (places.waiting() > 1) std::this_thread::yield();
    first.reset();
  }
  EXPECT_TRUE(got);
}

struct Measured {
  std::size_t sizeBytes() const { return 1; }
};

TEST(Measuring, IsDoneInFewPlacesAtOnce) {
  const auto processors = int(std::max(2u, std::thread::hardware_concurrency()));
  SharedBuilds<int, Measured> builds;
  std::atomic<int> running{0}, most{0}, measured{0};
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4 * processors; ++i)
      threads.emplace_back([&, i] {
        builds.get(i,
                   measuring<Measured>(nullptr, 1,
                                       [&](const std::stop_token&) {
                                         const int now = ++running;
                                         for (int seen = most;
                                              seen < now && !most.compare_exchange_weak(seen, now);) {
                                         }
                                         std::this_thread::sleep_for(std::chrono::milliseconds(2));
                                         --running;
                                         ++measured;
                                         return Measured();
                                       }),
                   {});
      });
  }
  EXPECT_EQ(measured, 4 * processors);
  EXPECT_LE(most, processors);
}

}  // namespace
}  // namespace scolopax
