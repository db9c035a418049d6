// SPDX-License-Identifier: Apache-2.0
#include "server/sparse_scene.h"

#include <string>
#include <utility>

#include "protocol/patch.h"
#include "protocol/scene_json.h"

namespace scolopax::server {
namespace {

using nlohmann::json;

/// Whether the patch does not change the channel.
bool keeps(const json& patch, std::size_t channel) {
  const auto channels = patch.find("channels");
  return channels == patch.end() || (channels->is_object() && !channels->contains(std::to_string(channel)));
}

}  // namespace

SparseScene SparseScene::patched(const json& patch, std::size_t channelCount) const {
  json rest = rest_;
  for (std::size_t i = 0; i < channels_.size(); ++i)
    if (!keeps(patch, i)) rest["channels"][i] = *channels_[i];
  SparseScene next;
  next.rest_ = protocol::applyPatch(std::move(rest), patch, channelCount);
  const auto channels = next.rest_.find("channels");
  if (channels == next.rest_.end()) return next;
  for (std::size_t i = 0; i < channels->size(); ++i)
    next.channels_.push_back(
        i < channels_.size() && keeps(patch, i)
            ? channels_[i]
            : std::make_shared<const json>(std::exchange((*channels)[i], json::object())));
  return next;
}

protocol::Scene SparseScene::parsed(const protocol::Lists& lists) const {
  protocol::Scene scene = protocol::parseScene(rest_, lists);
  for (std::size_t i = 0; i < channels_.size(); ++i)
    scene.channels[i] = protocol::parseChannel(*channels_[i], i, lists);
  return scene;
}

json SparseScene::whole() const {
  json scene = rest_;
  for (std::size_t i = 0; i < channels_.size(); ++i) scene["channels"][i] = *channels_[i];
  return scene;
}

}  // namespace scolopax::server
