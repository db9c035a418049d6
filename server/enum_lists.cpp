// SPDX-License-Identifier: Apache-2.0
#include "server/enum_lists.h"

#include <string>

#include "renderer/data/colormap.h"

namespace scolopax::server {

std::span<const EnumList> enumLists() {
  using protocol::Lists;
  static const EnumList lists[] = {
      {"blendModes", &Lists::blendModes, kBlendModes},
      {"methods", &Lists::methods, kMethods},
      {"filters", &Lists::filters, kPixelFilters},
      {"samplings", &Lists::samplings, kSamplings},
      {"colormaps", &Lists::colormaps, colormaps()},
      {"lightTypes", &Lists::lightTypes, kLightTypes},
      {"peaks", &Lists::peaks, kPeaks},
      {"interpolations", &Lists::interpolations, kInterpolations},
      {"aovs", nullptr, kAovs},
  };
  return lists;
}

protocol::Lists rendererLists() {
  protocol::Lists lists;
  for (const EnumList& list : enumLists()) {
    if (!list.wire) continue;
    for (const NamedValue& value : list.values)
      (lists.*list.wire).push_back({std::string(value.name), std::string(value.doc)});
  }
  return lists;
}

}  // namespace scolopax::server
