// SPDX-License-Identifier: Apache-2.0
// What the user has set of a scene, in JSON. SceneResolver makes whole scenes of it.
#pragma once
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"

namespace scolopax::server {

/// A sparse scene (protocol/patch.h). Its channels, whose curves may be long, are shared with the scenes that
/// were made from it by patches to something else.
class SparseScene {
 public:
  SparseScene() = default;
  /// Returns the scene with the patch applied. Throws as protocol::applyPatch does.
  SparseScene patched(const nlohmann::json& patch, std::size_t channelCount) const;
  /// Throws ProtocolError(422) as protocol::parseScene does.
  protocol::Scene parsed(const protocol::Lists& lists) const;
  nlohmann::json whole() const;
  const std::shared_ptr<const nlohmann::json>& channel(std::size_t index) const { return channels_[index]; }
  /// The scene, but for the channels, which are empty objects.
  const nlohmann::json& rest() const { return rest_; }

 private:
  nlohmann::json rest_ = nlohmann::json::object();
  std::vector<std::shared_ptr<const nlohmann::json>> channels_;
};

}  // namespace scolopax::server
