// SPDX-License-Identifier: Apache-2.0
// Where the frames of a DICOM file lie and how their values are scaled. Between dicom_file.cpp and GDCM.
#pragma once
#if SCOLOPAX_HAS_GDCM
#include "renderer/io/dicom_file.h"
#include "renderer/io/dicom_gdcm.h"

namespace scolopax::io {

/// Fills file.frames, and framesAreTimes, with `count` frames from the elements of the file or of its
/// functional groups. `name` begins errors. Throws Error(badInput) for false numbers.
void readDicomFrames(const gdcm::DataSet& elements, const std::string& name, std::size_t count,
                     DicomFile& file);

}  // namespace scolopax::io
#endif
