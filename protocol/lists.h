// SPDX-License-Identifier: Apache-2.0
// The allowed names of enumerated fields. The server fills them in from the renderer's lists, because the
// protocol does not depend on the renderer.
#pragma once
#include <string>
#include <vector>

namespace scolopax::protocol {

struct EnumEntry {
  std::string name;  ///< as on the wire
  std::string doc;   ///< description, one line
};

struct Lists {
  std::vector<EnumEntry> blendModes;
  std::vector<EnumEntry> methods;  ///< "auto" first
  std::vector<EnumEntry> filters;
  std::vector<EnumEntry> samplings;
  std::vector<EnumEntry> colormaps;
  std::vector<EnumEntry> lightTypes;
  std::vector<EnumEntry> peaks;
  std::vector<EnumEntry> interpolations;
};

}  // namespace scolopax::protocol
