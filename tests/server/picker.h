// SPDX-License-Identifier: Apache-2.0
// A session whose picks tests ask for, and the answers.
#pragma once
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/problem.h"
#include "server/pick.h"
#include "tests/server/fakes.h"

namespace scolopax::server::testing {

/// A session and the answers to its picks.
struct Picker {
  Workshop workshop;
  std::shared_ptr<Session> session = workshop.store.create(seedPatch(5));
  std::vector<PickAnswer> answers;

  void pick(const PickQuery& query = {1, 2}) {
    session->pick(query, [this](const PickAnswer& answer) { answers.push_back(answer); });
  }
  /// A hit at a voxel position of the fake volume.
  Picked at(glm::dvec3 voxel) const { return {voxel, voxel, 1, 7.5}; }
};

/// The HTTP status and the detail of a failed pick.
inline std::pair<int, std::string> pickProblem(const PickAnswer& answer) {
  try {
    if (answer.failure) std::rethrow_exception(answer.failure);
    return {200, ""};
  } catch (const protocol::ProtocolError& error) {
    return {error.status, error.what()};
  }
}

}  // namespace scolopax::server::testing
