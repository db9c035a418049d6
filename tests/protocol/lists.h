// SPDX-License-Identifier: Apache-2.0
// The names that scenes may use, from the renderer's lists: as the server hands them to the protocol.
#pragma once
#include <string>
#include <vector>

#include "protocol/lists.h"
#include "renderer/data/colormap.h"
#include "renderer/data/method.h"

namespace scolopax::protocol {

inline std::vector<EnumEntry> entriesOf(std::span<const NamedValue> values) {
  std::vector<EnumEntry> entries;
  for (const NamedValue& value : values) entries.push_back({std::string(value.name), std::string(value.doc)});
  return entries;
}

inline Lists rendererLists() {
  Lists lists{entriesOf(kBlendModes), entriesOf(kMethods), entriesOf(kPixelFilters), entriesOf(colormaps())};
  lists.methods.insert(lists.methods.begin(), {"auto", "chosen by the server"});
  return lists;
}

}  // namespace scolopax::protocol
