// SPDX-License-Identifier: Apache-2.0
// Picking: what is visible at a pixel or in a rectangle of a session's picture. Session stores the queries
// (PickQueue), and the render thread answers them with the Renderer.
#pragma once
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "renderer/data/pick.h"
#include "server/frame.h"
#include "server/scene_resolver.h"

namespace scolopax {
class Renderer;
}

namespace scolopax::server {

class Session;

/// A position in the session's picture, in pixels from its top left corner. With x2 and y2, the rectangle
/// between the two corners, given in any order and both included.
struct PickQuery {
  double x = 0, y = 0;
  std::optional<double> x2 = {}, y2 = {};
};

/// The pixels that a query covers. Throws ProtocolError(422) with the pointer of a coordinate that is missing
/// or outside the picture.
PixelArea areaOf(const PickQuery& query, int width, int height);

/// The answer as in the protocol: one hit for a pixel, or a list of hits for a rectangle, each voxel once.
nlohmann::json pickedJson(const ResolvedScene& scene, std::uint32_t revision, const PickQuery& query,
                          const std::vector<Picked>& found);

/// The result of a pick, or the reason why it failed: an Error or a ProtocolError.
struct PickAnswer {
  nlohmann::json found = {};
  std::exception_ptr failure = {};
};
using OnPicked = std::function<void(PickAnswer)>;

using PickId = std::uint64_t;
struct PendingPick {
  PickId id = 0;
  PickQuery query;
};

/// The pick on which a session's renderer works.
class CurrentPick {
 public:
  /// Begins or continues a pick for at most `slice`, and passes the answer to the session when it is
  /// complete. The renderer must have the scene. Throws nothing: if the pick fails, that is the answer, and
  /// `log` receives a cause that clients must not see.
  void run(const PendingPick& pick, const ResolvedScene& scene, std::uint32_t revision,
           const Renderer& renderer, std::chrono::nanoseconds slice, Session& session,
           const std::function<void(const std::string&)>& log);
  /// To be called before the renderer gets another scene or is destroyed. A pick in progress then starts
  /// over.
  void forget() { picking_.reset(); }

 private:
  PickId id_ = 0;
  std::unique_ptr<Picking> picking_;
};

}  // namespace scolopax::server
