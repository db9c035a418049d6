// SPDX-License-Identifier: Apache-2.0
// The parts of a scene that the user has set, in JSON. SceneResolver makes whole scenes of them.
#pragma once
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"

namespace scolopax::server {

/// A sparse scene (protocol/patch.h). Scenes made from it by patches share the channels that the patches do
/// not change, since their curves may be long.
class SparseScene {
 public:
  SparseScene() = default;
  /// Returns the scene with the patch applied. Throws as protocol::applyPatch does.
  SparseScene patched(const nlohmann::json& patch, std::size_t channelCount) const;
  /// Throws ProtocolError(422) as protocol::parseScene does.
  protocol::Scene parsed(const protocol::Lists& lists) const;
  nlohmann::json whole() const;
  const std::shared_ptr<const nlohmann::json>& channel(std::size_t index) const { return channels_[index]; }
  /// The scene without the contents of its channels, which are empty objects.
  const nlohmann::json& rest() const { return rest_; }

 private:
  nlohmann::json rest_ = nlohmann::json::object();
  std::vector<std::shared_ptr<const nlohmann::json>> channels_;
};

}  // namespace scolopax::server
