// SPDX-License-Identifier: Apache-2.0
// Patches of a sparse scene: RFC 7396, and objects with decimal keys that patch the elements of a list.
// A sparse scene is what the user set: parseScene takes it, and it holds no null.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>

namespace scolopax::protocol {

/// The sparse scene with the patch applied. Lists of objects grow with {} up to the highest index named,
/// never beyond `channelCount`. Values are checked by parseScene afterwards; here ProtocolError(422) is
/// thrown for unknown fields, objects where none can be, and indices that do not exist. `sparse` must be a
/// scene that parseScene accepts; {} is one, so applyPatch({}, scene, n) makes a whole scene sparse.
nlohmann::json applyPatch(const nlohmann::json& sparse, const nlohmann::json& patch,
                          std::size_t channelCount);

/// The patch with applyPatch(from, patch) == to. Both sparse, or both resolved (toJson), for the same data
/// set's channels or fewer.
nlohmann::json mergePatchBetween(const nlohmann::json& from, const nlohmann::json& to);

}  // namespace scolopax::protocol
