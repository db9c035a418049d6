// SPDX-License-Identifier: Apache-2.0
// A DICOM header as bytes, for the way out of the process that reads it. Between dicom_file.h and
// dicom_decoding.cpp.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "renderer/io/dicom_file.h"

namespace scolopax::io {

/// All but the path.
std::vector<std::byte> packDicomFile(const DicomFile& file);

/// The reverse. Throws Error(badInput) if the numbers are none that readDicomFile gives: the library may have
/// damaged the process that sent them.
DicomFile unpackDicomFile(std::span<const std::byte> bytes, const std::filesystem::path& path);

}  // namespace scolopax::io
