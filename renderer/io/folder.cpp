// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/folder.h"

#include <algorithm>
#include <string>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

std::string_view digitsAt(std::string_view text, std::size_t at) {
  std::size_t end = at;
  while (end < text.size() && isDigit(text[end])) ++end;
  while (at + 1 < end && text[at] == '0') ++at;
  return text.substr(at, end - at);
}

struct FolderSearch {
  const OpenOptions& options;
  std::size_t entries = 0;
  std::vector<fs::path> found = {};

  void descend(const fs::path& folder) {
    std::vector<fs::path> all, folders;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      if (options.stop.stop_requested()) throw Error(ErrorCode::cancelled, "opening was cancelled");
      if (++entries > kMostFolderEntries)
        throw Error(ErrorCode::tooLarge, shown(folder) + ": expected at most " +
                                             std::to_string(kMostFolderEntries) +
                                             " files and folders below what is served, found more");
      if (!entry->path().filename().string().starts_with('.')) all.push_back(entry->path());
    }
    if (error) throw Error(ErrorCode::io, shown(folder) + ": " + error.message());
    std::ranges::sort(all, [](const fs::path& a, const fs::path& b) {
      return comesBefore(a.filename().string(), b.filename().string());
    });
    for (const fs::path& path : all) {
      std::error_code ignored;
      if (!fs::is_regular_file(path, ignored) && !fs::is_directory(path, ignored)) continue;
      if (findFormat(path))
        found.push_back(path);
      else if (fs::is_directory(path, ignored) && !fs::is_symlink(path, ignored))
        folders.push_back(path);
    }
    for (const fs::path& inner : folders) descend(inner);
  }
};

}  // namespace

bool comesBefore(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (isDigit(a[i]) && isDigit(b[j])) {
      const std::string_view x = digitsAt(a, i), y = digitsAt(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
      i = std::size_t(x.data() + x.size() - a.data());
      j = std::size_t(y.data() + y.size() - b.data());
    } else {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i, ++j;
    }
  }
  if (i == a.size() && j == b.size()) return a < b;  // differ in leading zeros, or are equal
  return i == a.size();
}

std::vector<fs::path> volumesIn(const fs::path& folder, const OpenOptions& options) {
  FolderSearch search{options};
  search.descend(folder);
  return std::move(search.found);
}

}  // namespace scolopax::io
