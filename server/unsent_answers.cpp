// SPDX-License-Identifier: Apache-2.0
#include "server/unsent_answers.h"

#include <map>
#include <mutex>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"

namespace scolopax::server {
namespace {

[[noreturn]] void refuse(ErrorCode code, const char* whose, std::uint64_t most, std::uint64_t unsent,
                         std::uint64_t bytes) {
  throw Error(code, std::string("memory for answers to ") + whose + ": expected at most " + mebibytes(most) +
                        (unsent > 0 ? ", of which " + mebibytes(unsent) + " have not been read" : "") +
                        ", found " + mebibytes(bytes));
}

}  // namespace

struct UnsentAnswers::State {
  explicit State(std::shared_ptr<MemoryBudget> budget) : memory(std::move(budget)) {}
  const std::shared_ptr<MemoryBudget> memory;
  std::mutex mutex;                             ///< guards the members below
  std::map<std::string, std::uint64_t> byFlow;  ///< bytes of the flows that have unsent answers
  std::uint64_t all = 0;

  void add(const std::string& flow, std::uint64_t bytes) {
    const std::lock_guard lock(mutex);
    const std::uint64_t most = memory->limit() / 4, mostOfFlow = most / 2;
    const auto known = byFlow.find(flow);
    const std::uint64_t mine = known == byFlow.end() ? 0 : known->second;
    if (mine + bytes > kFairBytes) {
      if (bytes > most) refuse(ErrorCode::tooLarge, "all clients", most, 0, bytes);
      if (mine > 0 && mine + bytes > mostOfFlow)
        refuse(ErrorCode::busy, "one session or address", mostOfFlow, mine, bytes);
      if (all + bytes > most) refuse(ErrorCode::busy, "all clients", most, all, bytes);
    }
    byFlow[flow] += bytes;
    all += bytes;
  }
  void remove(const std::string& flow, std::uint64_t bytes) {
    const std::lock_guard lock(mutex);
    const auto mine = byFlow.find(flow);
    all -= bytes;
    if ((mine->second -= bytes) == 0) byFlow.erase(mine);
  }
};

UnsentAnswers::UnsentAnswers(std::shared_ptr<MemoryBudget> memory)
    : state_(std::make_shared<State>(std::move(memory))) {}

std::shared_ptr<const void> UnsentAnswers::take(const std::string& flow, std::uint64_t bytes) const {
  if (!state_->memory || bytes <= MemoryBudget::kFreeBytes) return nullptr;
  struct Answer {
    Answer(std::shared_ptr<State> given, std::string name, std::uint64_t size)
        : state(std::move(given)), flow(std::move(name)), bytes(size) {
      state->add(flow, bytes);
    }
    ~Answer() { state->remove(flow, bytes); }
    Answer(const Answer&) = delete;
    Answer& operator=(const Answer&) = delete;
    const std::shared_ptr<State> state;
    const std::string flow;
    const std::uint64_t bytes;
    MemoryBudget::Share share;
  };
  auto answer = std::make_shared<Answer>(state_, flow, bytes);
  answer->share = MemoryBudget::take(state_->memory, MemoryUse::answers, bytes);
  return answer;
}

}  // namespace scolopax::server
