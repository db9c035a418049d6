// SPDX-License-Identifier: Apache-2.0
// An archive of NumPy arrays: a zip file, read by libzip, in which each array is a volume.
#include "renderer/io/formats.h"

#if SCOLOPAX_HAS_ZIP
#include <zip.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/npy_array.h"
#include "renderer/io/text.h"
#endif

namespace scolopax::io {

Match matchNpz(const FileStart& start) {
  // A local header of zip: signature, and at 26 the length of the name that stands at 30.
  constexpr std::size_t kNameLengthAt = 26, kNameAt = 30;
  if (start.bytes.starts_with("PK\x03\x04") && start.bytes.size() > kNameAt) {
    const auto byte = [&](std::size_t i) { return std::size_t(static_cast<unsigned char>(start.bytes[i])); };
    const std::size_t length = byte(kNameLengthAt) | byte(kNameLengthAt + 1) << 8;
    if (std::string_view(start.bytes).substr(kNameAt, length).ends_with(".npy")) return Match::content;
  }
  return start.hasEnding(".npz") && !start.folder ? Match::name : Match::no;
}

#if SCOLOPAX_HAS_ZIP
namespace {
namespace fs = std::filesystem;

/// The archive, open for reading.
class NpzArchive {
 public:
  explicit NpzArchive(const fs::path& path) : file(shown(path)) {
    requireRegularFile(path);
    int code = 0;
    zip_.reset(::zip_open(path.c_str(), ZIP_RDONLY, &code));
    if (zip_) return;
    zip_error_t error;
    ::zip_error_init_with_code(&error, code);
    const std::string reason = cleanText(::zip_error_strerror(&error));
    ::zip_error_fini(&error);
    throw Error(ErrorCode::badInput, file + ": expected a zip archive, found: " + reason);
  }

  std::uint64_t count() const {
    return std::uint64_t(std::max<zip_int64_t>(::zip_get_num_entries(zip_.get(), 0), 0));
  }
  std::string name(std::uint64_t index) const {
    const char* name = ::zip_get_name(zip_.get(), index, ZIP_FL_ENC_RAW);
    return name ? name : "";
  }
  zip_t* get() const { return zip_.get(); }

  std::string file;  ///< for messages

 private:
  struct Close {
    void operator()(zip_t* zip) const { ::zip_discard(zip); }
  };
  std::unique_ptr<zip_t, Close> zip_;
};

class NpzEntry : public NpySource {
 public:
  NpzEntry(const NpzArchive& archive, std::uint64_t index, std::string where)
      : where_(std::move(where)), entry_(::zip_fopen_index(archive.get(), index, 0)) {
    if (!entry_)
      throw bad("expected an array that can be unpacked", cleanText(::zip_strerror(archive.get())));
    zip_stat_t stat;
    ::zip_stat_init(&stat);
    constexpr std::uint64_t kDeflateLimit = 1032;  // the most that deflate expands
    if (::zip_stat_index(archive.get(), index, 0, &stat) != 0) throw bad("expected its size", "none");
    const bool packed = stat.comp_method != ZIP_CM_STORE;
    // Other methods than deflate can expand further; then the stated size is all there is to go by.
    const bool deflated = stat.comp_method == ZIP_CM_DEFLATE;
    largestSize = packed && !deflated
                      ? stat.size
                      : std::min<std::uint64_t>(
                            stat.size, saturatingProduct(stat.comp_size, packed ? kDeflateLimit : 1));
  }

  void read(std::span<std::byte> bytes) override {
    for (std::size_t done = 0; done < bytes.size();) {
      const zip_int64_t got = ::zip_fread(entry_.get(), bytes.data() + done, bytes.size() - done);
      if (got < 0) throw bad("expected sound data", cleanText(::zip_file_strerror(entry_.get())));
      if (got == 0) throw bad("expected more data", "the end");
      done += std::size_t(got);
    }
  }
  void skip(std::uint64_t count) override {
    std::array<std::byte, 1 << 14> scratch;
    for (; count > 0; count -= std::min<std::uint64_t>(count, scratch.size()))
      read(std::span(scratch).first(std::size_t(std::min<std::uint64_t>(count, scratch.size()))));
  }
  /// Verifies the checksum if everything has been read.
  void finish() {
    std::byte none{};
    if (::zip_fread(entry_.get(), &none, 1) < 0)
      throw bad("expected sound data", cleanText(::zip_file_strerror(entry_.get())));
  }

  std::uint64_t largestSize = 0;  ///< the most bytes that it can hold

 private:
  struct Close {
    void operator()(zip_file_t* entry) const { ::zip_fclose(entry); }
  };
  Error bad(const char* expected, const std::string& found) const {
    return Error(ErrorCode::badInput, where_ + ": " + expected + ", found: " + found);
  }

  std::string where_;
  std::unique_ptr<zip_file_t, Close> entry_;
};

/// Throws Error(badInput) if the entry is too short for its array.
void checkNpzHolds(const std::string& where, const NpzEntry& entry, const NpyArray& array) {
  const std::uint64_t needed = saturatingSum(array.dataOffset, array.layout.sizeBytes());
  if (needed > entry.largestSize)
    throw Error(ErrorCode::badInput, where + ": " + array.layout.description() + " needs " +
                                         byteCount(needed) + ", the archive holds at most " +
                                         byteCount(entry.largestSize));
}

/// Where an array is in the archive.
struct NpzArray {
  std::uint64_t index = 0;
  std::string where = {};  ///< file and array, for messages
  NpyArray array = {};
};

std::vector<VoxelBuffer> readNpz(const fs::path& path, const NpzArray& found, const VolumeInfo& volume,
                                 const Part& part, Loading& loading) {
  const NpzArchive archive(path);
  NpzEntry entry(archive, found.index, found.where);
  checkNpzHolds(found.where, entry, found.array);
  auto voxels = readNpyVoxels(found.where, found.array, entry, volume, part, loading);
  entry.finish();
  return voxels;
}

/// Throws Error(unsupported) for an array that is none of the archive's volumes.
NpzArray describeNpzArray(const NpzArchive& archive, std::uint64_t index, const std::string& name,
                          FourthAxis fourthAxis) {
  NpzArray found{index, archive.file + ":" + cleanText(name)};
  NpzEntry entry(archive, index, found.where);
  const NpyHeader header = readNpyHeader(found.where, entry);
  const auto expected = [&](const std::string& what) {
    return Error(ErrorCode::unsupported, found.where + ": shape: expected " + what);
  };
  // Such as a spacing that is stored beside the volume.
  if (header.shape.size() < 2) throw expected("2 to 4 axes, found " + std::to_string(header.shape.size()));
  if (std::ranges::find(header.shape, 0) != header.shape.end()) throw expected("elements, found none");
  found.array = arrangeNpy(found.where, header, fourthAxis);
  checkNpzHolds(found.where, entry, found.array);
  return found;
}

}  // namespace

VolumeFile openNpz(const fs::path& path, const OpenOptions& options) {
  constexpr std::uint64_t kMostNpzEntries = 4096;
  const NpzArchive archive(path);
  if (archive.count() > kMostNpzEntries)
    throw Error(ErrorCode::unsupported,
                archive.file + ": expected at most 4096 arrays, found " + std::to_string(archive.count()));
  VolumeFile file{path};
  std::vector<NpzArray> arrays;
  std::optional<Error> firstError;
  for (std::uint64_t i = 0; i < archive.count(); ++i) {
    std::string name = archive.name(i);
    if (!name.ends_with(".npy")) {
      options.warn(archive.file + ": " + inQuotes(name) + " is no array and is left out");
      continue;
    }
    name.resize(name.size() - 4);
    try {
      arrays.push_back(describeNpzArray(archive, i, name, options.fourthAxis));
    } catch (const Error& error) {  // the other arrays may be volumes
      if (error.code() != ErrorCode::unsupported) throw;
      if (!firstError) firstError = error;
      options.warn(std::string(error.what()) + "; it is left out");
      continue;
    }
    file.volumes.push_back(npyVolume(arrays.back().array));
    file.volumes.back().path = name;
  }
  if (file.volumes.empty() && firstError) throw *firstError;
  file.read = [path, arrays](const VolumeInfo& volume, const Part& part, Loading& loading) {
    return readNpz(path, arrays.at(part.volume), volume, part, loading);
  };
  return file;
}
#endif

}  // namespace scolopax::io
