// SPDX-License-Identifier: Apache-2.0
// What is visible at a pixel or in a rectangle of a session's picture: the question, and its answer by the
// render thread. Between Session, which keeps the questions, and Renderer.
#pragma once
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "renderer/data/pick.h"
#include "server/scene_resolver.h"

namespace scolopax {
class Renderer;
}

namespace scolopax::server {

class Session;

/// Pixels of the session's picture from its top left corner; with x2 and y2 the rectangle from one to the
/// other, in any order, both included.
struct PickQuery {
  double x = 0, y = 0;
  std::optional<double> x2 = {}, y2 = {};
};

/// Throws ProtocolError(422) with the pointer of a coordinate that is missing or outside of the picture.
PixelArea areaOf(const PickQuery& query, int width, int height);

/// An answer as the protocol has it: of a pixel, or a list of a rectangle's, each voxel once.
nlohmann::json pickedJson(const ResolvedScene& scene, std::uint32_t revision, const PickQuery& query,
                          const std::vector<Picked>& found);

/// What was found, or why nothing could be: an Error or a ProtocolError.
struct PickAnswer {
  nlohmann::json found = {};
  std::exception_ptr failure = {};
};
using OnPicked = std::function<void(const PickAnswer&)>;

using PickId = std::uint64_t;
struct PendingPick {
  PickId id = 0;
  PickQuery query;
};

/// The pick that a session's renderer is at.
class PickTurn {
 public:
  /// Goes on with a pick, or begins it, and tells the session when it is done. The renderer has the scene.
  void run(const PendingPick& pick, const ResolvedScene& scene, std::uint32_t revision,
           const Renderer& renderer, std::chrono::nanoseconds slice, Session& session);
  /// Before the renderer takes another scene, or goes: what was begun begins anew.
  void forget() { picking_.reset(); }

 private:
  PickId id_ = 0;
  std::unique_ptr<Picking> picking_;
};

}  // namespace scolopax::server
