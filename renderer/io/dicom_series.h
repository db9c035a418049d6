// SPDX-License-Identifier: Apache-2.0
// Volumes from the slices of DICOM files: what belongs together, in which order, and on which grid. Between
// dicom_file.h and dicom.cpp.
#pragma once
#include <string>
#include <vector>

#include "renderer/io/dicom_file.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// One frame of a file and where it belongs in its volume.
struct DicomSlice {
  std::size_t file = 0, frame = 0;
  std::size_t z = 0, time = 0;
  std::size_t channel = 0;  ///< of segmentations; otherwise samples are channels
};

/// A volume of slices.
struct DicomSeries {
  VolumeInfo info;
  std::vector<DicomSlice> slices;  ///< by file and frame
  bool rescaled = false;  ///< slices differ in scale or type: the voxels are their data values, as float32
  bool sparse = false;    ///< slices may be left out, which are 0 then
};

/// Sorts the frames of all files into volumes. `name` begins errors and warnings. Series that cannot be shown
/// are left out with a warning. Throws their Error if none remains: unsupported for uneven slice distances.
std::vector<DicomSeries> arrangeDicom(const std::vector<DicomFile>& files, const std::string& name,
                                      const Warn& warn);

/// The grid of slices at positions that are one `step` apart, all in the patient's axes of DICOM.
Grid dicomGrid(const DicomFile& file, const DicomFrame& first, std::size_t slices, const glm::dvec3& step);

/// Throws Error(unsupported), naming the steps, unless the positions, sorted along the normal, are evenly
/// spaced within 1 % of their mean distance. Returns the step. Warns of slices that are shifted against each
/// other, as by a tilted gantry. `positions`: two or more.
glm::dvec3 evenStep(const std::vector<glm::dvec3>& positions, const glm::dvec3& normal,
                    const std::string& name, const Warn& warn);

}  // namespace scolopax::io
