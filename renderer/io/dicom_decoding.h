// SPDX-License-Identifier: Apache-2.0
// Reads headers and pixels of many DICOM files. Between dicom_file.h and dicom.cpp.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/io/dicom_file.h"
#include "renderer/io/loading.h"

namespace scolopax::io {

/// Reads the headers of the files and calls take(header), or fail(error), for each in turn. Throws
/// Error(cancelled) once `stop` is requested.
void readDicomHeaders(const std::vector<std::filesystem::path>& paths, const std::stop_token& stop,
                      const std::function<void(DicomFile)>& take,
                      const std::function<void(const Error&)>& fail);

/// Frames of a file that are wanted.
struct DicomFrames {
  const DicomFile* file = nullptr;
  std::vector<std::size_t> frames = {};
};

/// A decoded frame: of `wanted`, of its frames.
struct DecodedFrame {
  std::size_t wanted = 0, frame = 0;  ///< indices
  std::span<const std::byte> bytes = {};
  bool planar = false;
};

/// Decodes the frames in order. Throws Error as decodeDicomFile does, and tooLarge if a file needs too much
/// memory.
void decodeDicomFrames(const std::vector<DicomFrames>& wanted, Loading& loading,
                       const std::function<void(const DecodedFrame&)>& take);

}  // namespace scolopax::io
