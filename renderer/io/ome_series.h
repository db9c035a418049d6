// SPDX-License-Identifier: Apache-2.0
// One image of an OME-TIFF as a volume. Between the OME-XML, with the pages that it names, and the reader.
#pragma once
#include <string>
#include <vector>

#include "renderer/io/ome_planes.h"
#include "renderer/io/tiff_decode.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// What the pages of an image have in common, and where they are.
struct OmeSeries {
  OmePlanes planes;
  int samples = 1;         ///< channel i is sample i % samples of plane i / samples
  OIIO::TypeDesc numbers;  ///< as the pages say
};

/// Width, height and numbers of a page, for comparison and messages.
std::string omePageText(const OIIO::ImageSpec& spec);

/// Describes the image by its XML and the page of its first plane, and sets `series`. `where` begins errors
/// and warnings. Throws Error: badInput if the XML and the pages do not fit, unsupported for types and sizes
/// that cannot be shown, and what TiffPages throws.
VolumeInfo openOmeImage(const std::string& where, const OmeImage& image, OmeFiles& files, OmeSeries& series,
                        const Warn& warn);

}  // namespace scolopax::io
