// SPDX-License-Identifier: Apache-2.0
#include "server/net/fair_pool.h"

#include <gtest/gtest.h>

#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/net/gate.h"

namespace scolopax::net {
namespace {

/// Records the order in which jobs run.
class Notes {
 public:
  FairPool::Job job(const std::string& name) {
    return FairPool::Job([this, name] {
      const std::lock_guard lock(mutex_);
      names_.push_back(name);
    });
  }
  std::vector<std::string> names() {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> names_;
};

TEST(FairPool, LetsFlowsTakeTurns) {
  Gate gate;
  Notes notes;
  FairPool pool(1);
  pool.post("z", FairPool::Job([&] { gate.pass(); }));
  for (const char* name : {"a1", "a2", "a3", "b1", "b2", "c1"}) pool.post({name[0]}, notes.job(name));
  gate.open();
  pool.join();
  EXPECT_EQ(notes.names(), (std::vector<std::string>{"a1", "b1", "c1", "a2", "b2", "a3"}));
}

TEST(FairPool, RunsOneJobOfAFlowAtATimeAndOthersBeside) {
  Gate gate;
  Notes notes;
  FairPool pool(4);
  for (int i = 0; i < 10; ++i) pool.post("slow", FairPool::Job([&] { gate.pass(); }));
  gate.waitFor(1);
  for (const char* name : {"a", "b", "c"}) pool.post(name, notes.job(name));
  EXPECT_TRUE(eventually([&] { return notes.names().size() == 3; }));
  EXPECT_EQ(gate.arrived(), 1);
  gate.open();
  pool.join();
  EXPECT_EQ(gate.arrived(), 10);
}

TEST(FairPool, EndsWithTheJobsThatJobsPost) {
  Notes notes;
  FairPool pool(2);
  pool.post(
      "a", FairPool::Job([&] { pool.post("b", FairPool::Job([&] { pool.post("a", notes.job("last")); })); }));
  pool.join();
  pool.join();
  EXPECT_EQ(notes.names(), (std::vector<std::string>{"last"}));
}

TEST(FairPool, TellsOfJobsThatThrowAndGoesOn) {
  Notes notes;
  std::vector<std::string> failures;
  FairPool pool(1, [&] {
    try {
      throw;
    } catch (const std::exception& error) {
      failures.emplace_back(error.what());
    } catch (int number) {
      failures.push_back(std::to_string(number));
    }
  });
  pool.post("a", FairPool::Job([] { throw std::runtime_error("why"); }));
  pool.post("a", FairPool::Job([] { throw 42; }));
  pool.post("a", notes.job("last"));
  pool.join();
  EXPECT_EQ(failures, (std::vector<std::string>{"why", "42"}));
  EXPECT_EQ(notes.names(), (std::vector<std::string>{"last"}));
}

}  // namespace
}  // namespace scolopax::net
