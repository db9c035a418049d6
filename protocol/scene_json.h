// SPDX-License-Identifier: Apache-2.0
// JSON to the wire's scene and back, as the table of fields says.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include "protocol/lists.h"
#include "protocol/scene.h"

namespace scolopax::protocol {

/// Validates and reads a whole scene; what is absent, or null where null means automatic, takes its default.
/// Throws ProtocolError(422) with the pointer of the first bad or unknown field, what was expected and found.
Scene parseScene(const nlohmann::json& json, const Lists& lists);

/// Every field that has a value; an empty optional is left out. So there is no null in it, and
/// parseScene(toJson(scene)) is the same scene.
nlohmann::json toJson(const Scene& scene);

/// Throws ProtocolError(422) when the scene has more channels than the data set.
void checkChannelCount(const Scene& scene, std::size_t channelCount);

}  // namespace scolopax::protocol
