// SPDX-License-Identifier: Apache-2.0
// OME-XML (docs.openmicroscopy.org/ome-model), as far as it matters for reading: the images, their axes,
// channels and where their planes are. Comes from a TIFF's ImageDescription or a companion file.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/loading.h"
#include "renderer/io/volume_file.h"

namespace scolopax::io {

struct OmeChannel {
  std::string name;  ///< or the fluorophore, or the wavelength of emission; "" if the file tells none
  std::optional<std::array<std::uint8_t, 3>> color;  ///< sRGB; none for white, the default
  std::int64_t samples = 1;                          ///< numbers per pixel: 3 of an RGB picture
};

/// Says which pages hold planes, from the first plane on in the image's order.
struct OmeTiffData {
  std::int64_t firstZ = 0, firstC = 0, firstT = 0;
  std::optional<std::int64_t> page, count;  ///< IFD and PlaneCount, at least 0
  std::string fileName, uuid;               ///< "": the file that holds the XML
};

struct OmeImage {
  std::string name;
  std::int64_t sizeX = 1, sizeY = 1, sizeZ = 1, sizeC = 1, sizeT = 1;  ///< each at least 1
  std::string order = "XYZCT";                                         ///< of planes, fastest first
  std::string type;                                                    ///< "uint8", "float", ...
  std::array<std::optional<double>, 3> spacing;                        ///< in `unit`, positive
  std::string unit;                                                    ///< "um", ...; "" if unknown
  Times times;                                                         ///< sizeT of them
  std::vector<OmeChannel> channels;                                    ///< at least one
  std::vector<OmeTiffData> data;
};

struct OmeDocument {
  std::string uuid;       ///< of the file that holds the XML
  std::string companion;  ///< the file that holds the images instead of this one; "" if this one does
  std::vector<OmeImage> images;
};

/// `where` begins errors and warnings: file and field. Throws Error(badInput) for text that is not XML or not
/// OME, sizes below 1, and numbers that are none.
OmeDocument parseOmeXml(const std::string& where, std::string_view text, const Warn& warn);

/// Whether a text is OME-XML, by its root element.
bool looksLikeOmeXml(std::string_view text);

}  // namespace scolopax::io
