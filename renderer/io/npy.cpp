// SPDX-License-Identifier: Apache-2.0
// A NumPy array in a file of its own, plain or gzip.
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/npy_array.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

class NpyFile : public NpySource {
 public:
  explicit NpyFile(const std::filesystem::path& path) : stream(path, ByteStream::Encoding::detect) {}
  void read(std::span<std::byte> bytes) override { stream.read(bytes); }
  void skip(std::uint64_t count) override { stream.skip(count); }

  ByteStream stream;
};

}  // namespace

Match matchNpy(const FileStart& start) {
  if (start.holds(kNpyMagic)) return Match::content;
  const bool named = start.hasEnding(".npy") || start.hasEnding(".npy.gz");
  return named && !start.folder ? Match::name : Match::no;
}

VolumeFile openNpy(const std::filesystem::path& path, const OpenOptions& options) {
  const std::string where = shown(path);
  NpyFile source(path);
  const NpyArray array = arrangeNpy(where, readNpyHeader(where, source), options.fourthAxis);
  checkFileHolds(source.stream, array.layout, array.dataOffset);
  VolumeFile file{path};
  file.volumes = {npyVolume(array)};
  file.read = [path, where, array](const VolumeInfo& volume, const Part& part, Loading& loading) {
    NpyFile voxels(path);
    checkFileHolds(voxels.stream, array.layout, array.dataOffset);
    return readNpyVoxels(where, array, voxels, volume, part, loading);
  };
  return file;
}

}  // namespace scolopax::io
