// SPDX-License-Identifier: Apache-2.0
// Patches to a sparse scene: JSON Merge Patch (RFC 7396), extended by objects with decimal keys, which patch
// the elements of a list. A sparse scene holds only the values that the user has set. parseScene accepts it,
// and it contains no null.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include "protocol/scene.h"

namespace scolopax::protocol {

/// Returns the sparse scene with the patch applied. Lists of objects are extended with {} up to the highest
/// index in the patch, at most to the field's maxItems and, for channels, to `channelCount`. Throws
/// ProtocolError(422) for unknown fields, for objects where none is allowed, and for indices that do not
/// exist. Values are not checked; parseScene does that. `sparse` must be a scene that parseScene accepts. {}
/// is one, so applyPatch({}, scene, n) makes a whole scene sparse.
nlohmann::json applyPatch(nlohmann::json sparse, const nlohmann::json& patch, std::size_t channelCount);

/// Returns the patch for which applyPatch(toJson(from), patch, n) == toJson(to). Neither scene may have more
/// than n channels.
nlohmann::json patchBetween(const Scene& from, const Scene& to);

}  // namespace scolopax::protocol
