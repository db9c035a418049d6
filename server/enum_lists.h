// SPDX-License-Identifier: Apache-2.0
// The names that the renderer gives to values (blend modes, methods, ...): one list of lists, from which the
// protocol's validation and schema, the resolver and the capabilities take them.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "protocol/lists.h"
#include "renderer/data/method.h"

namespace scolopax::server {

struct EnumList {
  std::string_view name;  ///< in the capabilities
  /// The protocol's list of these names; null if they do not occur in a scene.
  std::vector<protocol::EnumEntry> protocol::Lists::*wire;
  std::span<const NamedValue> values;
};
std::span<const EnumList> enumLists();

/// The renderer's names, for validation and schema.
protocol::Lists rendererLists();

}  // namespace scolopax::server
