// SPDX-License-Identifier: Apache-2.0
// Converts JSON to the wire scene and back, as the table of fields describes.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include "protocol/lists.h"
#include "protocol/scene.h"

namespace scolopax::protocol {

/// Validates and reads a whole scene. Fields that are absent, or null where null means automatic, have their
/// defaults. Throws ProtocolError(422) with the pointer of the first invalid or unknown field, and what was
/// expected and found.
Scene parseScene(const nlohmann::json& json, const Lists& lists);

/// Reads one entry of a scene's channels, in the same way.
Channel parseChannel(const nlohmann::json& json, std::size_t index, const Lists& lists);

/// Writes every field that has a value and omits empty optionals. The result therefore contains no null, and
/// parseScene(toJson(scene)) is the same scene.
nlohmann::json toJson(const Scene& scene);

/// Throws ProtocolError(422) if the scene has more channels than the data set.
void checkChannelCount(const Scene& scene, std::size_t channelCount);

}  // namespace scolopax::protocol
