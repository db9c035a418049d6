// SPDX-License-Identifier: Apache-2.0
// A VTK data set as its file describes it: pieces of one regular grid, with arrays on points and on cells.
// Becomes a VolumeFile. Between vtk_xml.cpp, vtk_legacy.cpp and vtk_array.h.
#pragma once
#include <array>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "renderer/io/volume_file.h"
#include "renderer/io/vtk_array.h"

namespace scolopax::io {

/// Indices of points from `first` to `last`, both included.
struct VtkExtent {
  glm::i64vec3 first{0}, last{0};
  bool operator==(const VtkExtent&) const = default;
};

struct VtkPiece {
  VtkExtent extent;
  std::vector<VtkArray> points = {}, cells = {};
  std::vector<VtkArray> coordinates =
      {};  ///< three: of x, y and z; none if the grid is regular by definition
};

struct VtkDataSet {
  std::filesystem::path path;
  VtkExtent extent;  ///< of all pieces together
  /// Of point indices: index (0,0,0) is not in the grid if the extent begins elsewhere. For coordinates, it
  /// is found by vtkVolumes.
  glm::dmat4 worldFromIndex{1.0};
  std::vector<VtkPiece> pieces = {};
  std::vector<std::filesystem::path> dataFiles = {};
};

/// Coordinates may be off a line by so much of a step.
inline constexpr double kVtkEvenTolerance = 1e-3;

/// A volume of the arrays on points and one of those on cells, whose centres are half a step further in. Each
/// component is a channel. Throws Error(badInput) if the arrays or extents of pieces contradict each other or
/// the file is too short for them, Error(unsupported) for uneven coordinates and without arrays.
VolumeFile vtkVolumes(VtkDataSet dataSet, const OpenOptions& options);

}  // namespace scolopax::io
