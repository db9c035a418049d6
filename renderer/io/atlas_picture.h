// SPDX-License-Identifier: Apache-2.0
// One PNG of an atlas, decoded by OpenImageIO row by row. Between the file and atlas.cpp.
#pragma once
#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "renderer/io/channel_writer.h"

namespace scolopax::io {

/// How slices lie in a picture: from left to right in rows from top to bottom, without gaps.
struct AtlasTiles {
  glm::ivec3 dims{1};  ///< of the volume; a tile has dims.x by dims.y pixels
  int columns = 1;
};

/// A sample of the pixels, and where its voxels go.
struct AtlasSample {
  int index = 0;
  ChannelWriter* writer = nullptr;
};

class AtlasPicture {
 public:
  /// Reads the header. Throws Error(badInput) for a file that is no PNG or too small for the tiles.
  AtlasPicture(const std::filesystem::path& path, const AtlasTiles& tiles);

  /// The type of the picture's samples. Throws Error(badInput) if it has none with this index.
  StoredType sampleType(int sample) const;
  /// Reads the picture. Throws Error(badInput) if it is damaged or has other samples than the writers expect.
  void read(const std::vector<AtlasSample>& samples, Loading& loading);

 private:
  std::filesystem::path path_;
  std::string file_;
  AtlasTiles tiles_;
  std::unique_ptr<OIIO::ImageInput> input_;
};

}  // namespace scolopax::io
