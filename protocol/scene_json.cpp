// SPDX-License-Identifier: Apache-2.0
#include "protocol/scene_json.h"

#include "protocol/read_fields.h"

namespace scolopax::protocol {

Scene parseScene(const nlohmann::json& json, const Lists& lists) {
  Scene scene;
  readStruct(json, Path(), {lists}, scene);
  return scene;
}

Channel parseChannel(const nlohmann::json& json, std::size_t index, const Lists& lists) {
  Channel channel;
  const Path root, channels = root / "channels";
  readStruct(json, channels / index, {lists}, channel);
  return channel;
}

nlohmann::json toJson(const Scene& scene) { return writeValue(scene); }

void checkChannelCount(const Scene& scene, std::size_t channelCount) {
  if (scene.channels.size() <= channelCount) return;
  const Path root, channels = root / "channels";
  fail(channels / channelCount, "the data set has " + std::to_string(channelCount) + " channels, found " +
                                    std::to_string(scene.channels.size()));
}

}  // namespace scolopax::protocol
