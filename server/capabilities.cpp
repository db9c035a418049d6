// SPDX-License-Identifier: Apache-2.0
#include "server/capabilities.h"

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/frame_header.h"
#include "renderer/data/colormap.h"
#include "server/enum_lists.h"
#include "server/hex_color.h"
#include "server/image_types.h"
#include "server/limits.h"

namespace scolopax::server {

nlohmann::json capabilitiesJson(const Config& config) {
  using nlohmann::json;
  json told = {{"version", SCOLOPAX_VERSION},
               {"protocolVersion", protocol::kProtocolVersion},
               {"backend", config.backend},
               {"imageFormats", imageMediaTypes()},
               {"limits", limitsJson(config)}};
  for (const EnumList& list : enumLists()) {
    json& entries = told[std::string(list.name)] = json::array();
    for (const NamedValue& value : list.values) entries.push_back({{"name", value.name}, {"doc", value.doc}});
  }
  for (json& map : told["colormaps"]) {
    json& points = map["points"] = json::array();
    for (const ColorKnot& knot : colormapKnots(map["name"].get<std::string>()))
      points.push_back({knot.position, hexOf(knot.color)});
  }
  return told;
}

}  // namespace scolopax::server
