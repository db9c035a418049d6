// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_store.h"

#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

class ZarrFolder : public ZarrStore {
 public:
  explicit ZarrFolder(const fs::path& folder) : ZarrStore(shown(folder)) {
    std::error_code failed;
    root_ = fs::canonical(folder, failed);
    if (failed) throw Error(ErrorCode::io, shownKey("") + ": " + failed.message());
  }

  std::optional<std::vector<std::byte>> get(const std::string& key, std::uint64_t most) const override {
    const auto path = resolve(key);
    if (!path) return std::nullopt;
    ByteStream stream(*path, ByteStream::Encoding::plain);
    if (stream.largestSize() > most)
      throw Error(ErrorCode::tooLarge, shownKey(key) + ": expected at most " + std::to_string(most) +
                                           " bytes, found " + std::to_string(stream.largestSize()));
    std::vector<std::byte> bytes(stream.largestSize());
    stream.read(bytes);
    return bytes;
  }

  std::optional<std::vector<std::byte>> getRange(const std::string& key,
                                                 const ZarrRange& range) const override {
    const auto path = resolve(key);
    if (!path) return std::nullopt;
    const std::uint64_t holds = ByteStream(*path, ByteStream::Encoding::plain).largestSize();
    if (range.size > holds || range.offset > holds - range.size)
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected " + std::to_string(range.size) +
                                           " bytes at byte " + std::to_string(range.offset) + ", found " +
                                           std::to_string(holds) + " in all");
    ByteStream stream(*path, ByteStream::Encoding::plain, range.last ? holds - range.size : range.offset);
    std::vector<std::byte> bytes(range.size);
    stream.read(bytes);
    return bytes;
  }

  std::vector<std::string> list(const std::string& group) const override {
    constexpr std::size_t kMostEntries = 4096;
    std::vector<std::string> names;
    std::error_code failed;
    const fs::path folder = fs::canonical(root_ / group, failed);
    if (failed || !isInside(folder)) return {};
    for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
      names.push_back(at->path().filename().string());
      if (names.size() > kMostEntries)
        throw Error(ErrorCode::tooLarge, shownKey(group) + ": expected at most " +
                                             std::to_string(kMostEntries) + " entries, found more");
    }
    std::ranges::sort(names);
    return names;
  }

 private:
  bool isInside(const fs::path& real) const { return std::ranges::mismatch(root_, real).in1 == root_.end(); }

  /// The file of a key; none if there is none.
  std::optional<fs::path> resolve(const std::string& key) const {
    const fs::path path = root_ / key;
    std::error_code failed;
    const fs::file_status status = fs::status(path, failed);
    if (!fs::exists(status) || fs::is_directory(status)) return std::nullopt;
    const fs::path real = fs::canonical(path, failed);
    if (failed || !isInside(real))
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected a file below the folder, found a link");
    return real;
  }

  fs::path root_;
};

}  // namespace

std::string ZarrStore::shownKey(const std::string& key) const {
  return key.empty() ? name_ : name_ + (name_.ends_with('/') ? "" : "/") + cleanText(key);
}

std::string joinZarrPath(std::string_view group, std::string_view name) {
  std::string path(group);
  if (!group.empty() && !name.empty()) path += '/';
  return path += name;
}

std::optional<std::string> cleanZarrPath(std::string_view path) {
  std::string clean;
  while (!path.empty()) {
    const std::string_view part = path.substr(0, path.find('/'));
    path.remove_prefix(std::min(path.size(), part.size() + 1));
    if (part == ".." || part.find('\0') != std::string_view::npos) return std::nullopt;
    if (!part.empty() && part != ".") clean = joinZarrPath(clean, part);
  }
  return clean;
}

std::unique_ptr<ZarrStore> openZarrFolder(const fs::path& folder) {
  return std::make_unique<ZarrFolder>(folder);
}

}  // namespace scolopax::io
