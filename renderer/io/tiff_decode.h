// SPDX-License-Identifier: Apache-2.0
// The pixels of one page of a TIFF, by OpenImageIO. Between TiffPages and the readers of TIFF and OME-TIFF.
#pragma once
#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "renderer/io/stored_type.h"
#include "renderer/io/tiff_pages.h"

namespace scolopax::io {

/// Opens one resolution of a page, for its numbers as they are stored. `pages` must live as long. Throws
/// Error(badInput) if OpenImageIO refuses it.
std::unique_ptr<OIIO::ImageInput> openTiffPage(TiffPages& pages, std::size_t page, std::size_t level = 0);

/// Throws Error(unsupported), beginning with `file`, for depths that OpenImageIO would rescale.
StoredType tiffStoredType(const std::string& file, const OIIO::ImageSpec& spec);

/// The most bytes that one byte of the file can expand to.
std::uint64_t tiffExpansion(const OIIO::ImageSpec& spec);

/// Fills `page`, which has the size of the picture, with its interleaved samples in host byte order. Reads
/// row by row, or tile by tile: when OpenImageIO unpacks several deflated strips or tiles at once, it does
/// not report damage. Returns false on failure.
bool readTiffPixels(OIIO::ImageInput& input, std::vector<std::byte>& page);

}  // namespace scolopax::io
