// SPDX-License-Identifier: Apache-2.0
// The axes of VTK's rectilinear grids, and whether pieces cover a whole grid. Parts of vtk_dataset.cpp.
#pragma once
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "renderer/io/vtk_dataset.h"

namespace scolopax::io {

/// The affine of the point indices of a grid whose pieces have coordinates. Throws Error(unsupported), naming
/// the axis and its steps, unless they are even.
glm::dmat4 evenVtkAxes(const VtkDataSet& dataSet);

/// A part of a grid of voxels.
struct VtkBox {
  glm::ivec3 first{0}, size{1};
};

/// Throws Error(badInput) unless the boxes cover all of `dims`; they may overlap. Error(unsupported) if there
/// are too many to tell.
void checkVtkCover(const std::string& file, const glm::ivec3& dims, const std::vector<VtkBox>& boxes);

}  // namespace scolopax::io
