// SPDX-License-Identifier: Apache-2.0
// Where light makes a ray's radiance jump, bend or change fast, inside a part of the ray that is otherwise
// smooth. The integrator cuts there, so that its rules never span such a point.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "renderer/reference/gradient_along.h"
#include "renderer/reference/lighting.h"
#include "renderer/reference/stretch.h"

namespace scolopax::reference {

class LightCuts {
 public:
  /// Highlights and fades below `faintest` are ignored. World coordinates are relative to voxel (0,0,0).
  LightCuts(Lighting lighting, const glm::dmat3& worldFromVoxel, double faintest);

  /// Cuts from `begin` to `end`, a part of `stretch`, ascending. Between two of them no normal flips towards
  /// the viewer, no n.l or n.h passes zero and no fade saturates. Except in pieces of a millionth of the
  /// part, normals and directions to lights also turn little, and in a highlight little compared with its
  /// width.
  std::vector<double> of(const Stretch& stretch, double begin, double end,
                         const glm::dvec3& rayDirection) const;

 private:
  struct Line;
  struct Shaded;
  void appendKinks(const Line& line, const Shaded& shaded, std::vector<double>& cuts) const;
  bool isResolved(const Line& line, const std::vector<Shaded>& shaded, double begin, double end) const;
  bool isNormalResolved(const Line& line, const Shaded& shaded, double begin, double end) const;
  void refine(const Line& line, const std::vector<Shaded>& shaded, double begin, double end,
              std::vector<double>& cuts) const;

  Lighting lighting_;
  glm::dmat3 worldFromVoxel_, worldFromGradient_;
  double smallestSpacing_, faintest_;
};

}  // namespace scolopax::reference
