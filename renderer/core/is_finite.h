// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <glm/vec3.hpp>

namespace scolopax {

inline bool isFinite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace scolopax
