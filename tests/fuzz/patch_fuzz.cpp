// SPDX-License-Identifier: Apache-2.0
// Any bytes as scene, patch and message: the only exception is the protocol's error, and accepted input keeps
// the promises of patch.h.
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/json_text.h"
#include "protocol/messages.h"
#include "protocol/patch.h"
#include "protocol/problem.h"
#include "protocol/scene_json.h"

namespace protocol = scolopax::protocol;

namespace {

constexpr std::size_t kChannels = 4;

void require(bool holds) {
  if (!holds) std::abort();
}

void tryMessage(std::string_view text) try {
  protocol::parseClientMessage(text);
} catch (const protocol::ProtocolError& error) {
  protocol::errorText(error, 1);
}

void tryPatch(std::string_view sceneText, std::string_view patchText) try {
  static const protocol::Lists kLists{.blendModes = {{"density", ""}},
                                      .methods = {{"auto", ""}},
                                      .filters = {{"box", ""}},
                                      .samplings = {{"independent", ""}},
                                      .colormaps = {{"gray", ""}},
                                      .lightTypes = {{"headlight", ""}},
                                      .peaks = {{"off", ""}},
                                      .interpolations = {{"trilinear", ""}}};
  const nlohmann::json scene = protocol::parseJson(sceneText);
  const protocol::Scene before = protocol::parseScene(scene, kLists);
  const nlohmann::json sparse = protocol::applyPatch(nlohmann::json::object(), scene, kChannels);
  const nlohmann::json patch = protocol::parseJson(patchText);
  const nlohmann::json once = protocol::applyPatch(sparse, patch, kChannels);
  require(protocol::applyPatch(once, patch, kChannels) == once);
  const protocol::Scene parsed = protocol::parseScene(once, kLists);
  require(parsed.channels.size() <= kChannels);
  const nlohmann::json written = protocol::toJson(parsed);
  require(protocol::applyPatch(protocol::toJson(before), protocol::patchBetween(before, parsed), kChannels) ==
          written);
  require(protocol::toJson(protocol::parseScene(written, kLists)) == written);
} catch (const protocol::ProtocolError& error) {
  protocol::problemJson(error);
}

}  // namespace

/// The scene, a line break, the patch; without a line break, a patch of the empty scene.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t split = text.find('\n');
  if (split == std::string_view::npos) {
    tryMessage(text);
    tryPatch("{}", text);
  } else {
    tryPatch(text.substr(0, split), text.substr(split + 1));
  }
  return 0;
}
