// SPDX-License-Identifier: Apache-2.0
// Zarr in a ZIP archive (.zarr.zip, .ozx), by libzip.
#include <algorithm>
#include <array>
#include <mutex>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/stored_type.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_store.h"

#if SCOLOPAX_HAS_ZIP
#include <zip.h>
#endif

namespace scolopax::io {
namespace fs = std::filesystem;

#if SCOLOPAX_HAS_ZIP
namespace {

class ZarrZip : public ZarrStore {
 public:
  explicit ZarrZip(const fs::path& path) : ZarrStore(shown(path)) {
    requireRegularFile(path);
    int code = 0;
    archive_.reset(::zip_open(path.c_str(), ZIP_RDONLY, &code));
    if (!archive_) {
      zip_error_t error;
      ::zip_error_init_with_code(&error, code);
      const std::string reason = cleanText(::zip_error_strerror(&error));
      ::zip_error_fini(&error);
      throw Error(ErrorCode::badInput, shown(path) + ": expected a ZIP archive: " + reason);
    }
    findRoot();
  }

  std::optional<std::vector<std::byte>> get(const std::string& key, std::uint64_t most) const override {
    const std::lock_guard lock(mutex_);
    const auto entry = find(key);
    if (!entry) return std::nullopt;
    if (entry->size > most)
      throw Error(ErrorCode::tooLarge, shownKey(key) + ": expected at most " + std::to_string(most) +
                                           " bytes, found " + std::to_string(entry->size));
    return read(key, *entry, 0, entry->size);
  }

  std::optional<std::vector<std::byte>> getRange(const std::string& key,
                                                 const ZarrRange& range) const override {
    const std::lock_guard lock(mutex_);
    const auto entry = find(key);
    if (!entry) return std::nullopt;
    if (range.size > entry->size || range.offset > entry->size - range.size)
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected " + std::to_string(range.size) +
                                           " bytes at byte " + std::to_string(range.offset) + ", found " +
                                           std::to_string(entry->size) + " in all");
    return read(key, *entry, range.last ? entry->size - range.size : range.offset, range.size);
  }

  std::vector<std::string> list(const std::string& group) const override {
    const std::lock_guard lock(mutex_);
    const std::string folder = joinZarrPath(root_, group) + (root_.empty() && group.empty() ? "" : "/");
    std::vector<std::string> names;
    forEachName([&](std::string_view name) {
      if (!name.starts_with(folder)) return;
      name.remove_prefix(folder.size());
      const std::string_view first = name.substr(0, name.find('/'));
      if (!first.empty() && (names.empty() || names.back() != first)) names.emplace_back(first);
    });
    std::ranges::sort(names);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
  }

 private:
  struct Entry {
    zip_uint64_t index;
    std::uint64_t size;
    bool stored;
  };

  template <class F>
  void forEachName(F&& f) const {
    const zip_int64_t count = ::zip_get_num_entries(archive_.get(), 0);
    for (zip_int64_t i = 0; i < count; ++i)
      if (const char* name = ::zip_get_name(archive_.get(), zip_uint64_t(i), ZIP_FL_ENC_GUESS))
        f(std::string_view(name));
  }

  /// Archives made of a folder have that folder around everything.
  void findRoot() {
    for (const char* document : {"zarr.json", ".zgroup", ".zarray", ".zattrs"})
      if (::zip_name_locate(archive_.get(), document, 0) >= 0) return;
    std::optional<std::string> common;
    bool shared = true;
    forEachName([&](std::string_view name) {
      const std::string first(name.substr(0, std::min(name.find('/'), name.size())));
      if (!common) common = first;
      shared = shared && *common == first;
    });
    if (common && shared) root_ = *common;
  }

  std::optional<Entry> find(const std::string& key) const {
    const zip_int64_t index = ::zip_name_locate(archive_.get(), joinZarrPath(root_, key).c_str(), 0);
    if (index < 0) return std::nullopt;
    zip_stat_t stat;
    constexpr zip_uint64_t kNeeded = ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD;
    if (::zip_stat_index(archive_.get(), zip_uint64_t(index), 0, &stat) != 0 ||
        (stat.valid & kNeeded) != kNeeded)
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected the sizes of an entry, found none");
    if (stat.comp_method != ZIP_CM_STORE && stat.comp_method != ZIP_CM_DEFLATE)
      throw Error(ErrorCode::unsupported, shownKey(key) +
                                              ": expected a stored or deflated entry, found method " +
                                              std::to_string(stat.comp_method));
    constexpr std::uint64_t kDeflateRatio = 1032;
    if (stat.size > saturatingProduct(stat.comp_size, kDeflateRatio))
      throw Error(ErrorCode::badInput,
                  shownKey(key) + ": expected at most 1032 bytes of each packed one, found " +
                      std::to_string(stat.size) + " of " + std::to_string(stat.comp_size));
    return Entry{zip_uint64_t(index), stat.size, stat.comp_method == ZIP_CM_STORE};
  }

  std::vector<std::byte> read(const std::string& key, const Entry& entry, std::uint64_t offset,
                              std::uint64_t size) const {
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(
        ::zip_fopen_index(archive_.get(), entry.index, 0), ::zip_fclose);
    const auto refuse = [&] {
      return Error(ErrorCode::badInput, shownKey(key) + ": the ZIP entry is damaged or encrypted");
    };
    if (!file) throw refuse();
    if (entry.stored && offset > 0 && ::zip_fseek(file.get(), zip_int64_t(offset), SEEK_SET) == 0) offset = 0;
    for (std::array<std::byte, 1 << 16> skipped; offset > 0;) {
      const zip_int64_t got =
          ::zip_fread(file.get(), skipped.data(), std::min<std::uint64_t>(offset, skipped.size()));
      if (got <= 0) throw refuse();
      offset -= std::uint64_t(got);
    }
    std::vector<std::byte> bytes(size);
    for (std::size_t done = 0; done < bytes.size();) {
      const zip_int64_t got = ::zip_fread(file.get(), bytes.data() + done, bytes.size() - done);
      if (got <= 0) throw refuse();
      done += std::size_t(got);
    }
    // The end, at which libzip compares the checksum.
    std::byte more;
    if (size == entry.size && ::zip_fread(file.get(), &more, 1) != 0) throw refuse();
    return bytes;
  }

  std::unique_ptr<zip_t, void (*)(zip_t*)> archive_{nullptr, ::zip_discard};
  std::string root_;          ///< the folder around everything, or ""
  mutable std::mutex mutex_;  ///< libzip's archives are for one thread at a time
};

}  // namespace

std::unique_ptr<ZarrStore> openZarrZip(const fs::path& path) { return std::make_unique<ZarrZip>(path); }
#else
std::unique_ptr<ZarrStore> openZarrZip(const fs::path& path) {
  throw Error(ErrorCode::unsupported, shown(path) +
                                          ": zipped OME-Zarr needs the library of " SCOLOPAX_LACKS_ZIP
                                          ", without which this program was built");
}
#endif

}  // namespace scolopax::io
