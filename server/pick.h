// SPDX-License-Identifier: Apache-2.0
// Picking: what is visible at a pixel or in a rectangle of a session's picture. Session stores the queries
// (PickQueue), and the render thread answers them (CurrentPick).
#pragma once
#include <cstdint>
#include <exception>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "renderer/data/pick.h"
#include "server/frame.h"
#include "server/scene_resolver.h"

namespace scolopax::server {

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
/// `volume`: the one that the scene shows.
nlohmann::json pickedJson(const ResolvedScene& scene, const Volume& volume, std::uint32_t revision,
                          const PickQuery& query, const std::vector<Picked>& found);

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
  std::uint32_t revision = 0;  ///< of the scene when it was asked
};

}  // namespace scolopax::server
