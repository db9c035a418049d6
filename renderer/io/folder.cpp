// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/folder.h"

#include <algorithm>
#include <fstream>
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

bool isReadable(const fs::path& file) { return std::ifstream(file).is_open(); }

struct FolderSearch {
  const fs::path& root;
  const OpenOptions& options;
  const fs::path canonicalRoot;
  std::size_t entries = 0;
  std::vector<fs::path> found = {};

  void leaveOut(const std::string& what) const {
    if (options.warn) options.warn(what + "; left out");
  }

  void count() {
    if (options.stop.stop_requested()) throw Error(ErrorCode::cancelled, "opening was cancelled");
    if (++entries > kMostFolderEntries)
      throw Error(ErrorCode::tooLarge, shown(root) + ": expected at most " +
                                           std::to_string(kMostFolderEntries) +
                                           " files and folders below what is served, found more");
  }

  /// Whether it is a link to something that is not below the folder.
  bool leadsOut(const fs::path& path) const {
    std::error_code failed;
    if (!fs::is_symlink(path, failed)) return false;
    const fs::path target = fs::canonical(path, failed);
    return failed || std::ranges::mismatch(canonicalRoot, target).in1 != canonicalRoot.end();
  }

  /// What is in the folder, without hidden entries, sorted.
  std::vector<fs::path> list(const fs::path& folder) {
    std::vector<fs::path> all;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      count();
      if (!entry->path().filename().string().starts_with('.')) all.push_back(entry->path());
    }
    if (error) {
      const std::string message = shown(folder) + ": " + error.message();
      if (folder == root) throw Error(ErrorCode::io, message);
      leaveOut(message);
    }
    std::ranges::sort(all, [](const fs::path& a, const fs::path& b) {
      return comesBefore(a.filename().string(), b.filename().string());
    });
    return all;
  }

  /// A file, unless it is read with others by `together`.
  void addFile(const fs::path& path, const Format* together) {
    const Format* format = findFormat(path);
    if (format && format != together) found.push_back(path);
    if (!format && !isReadable(path)) leaveOut(shown(path) + ": cannot be read");
  }

  void descend(const fs::path& folder) {
    const std::vector<fs::path> all = list(folder);
    const FormatMatch own = findMatch(folder);
    const Format* together = own.match == Match::files ? own.format : nullptr;
    if (together) found.push_back(folder);
    std::vector<fs::path> folders;
    std::error_code ignored;
    for (const fs::path& path : all) {
      if (leadsOut(path)) continue;
      if (fs::is_regular_file(path, ignored)) addFile(path, together);
      if (!fs::is_directory(path, ignored)) continue;
      if (claimsAllBelow(path))
        found.push_back(path);
      else if (!fs::is_symlink(path, ignored))
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

bool claimsAllBelow(const fs::path& folder) {
  const Match match = findMatch(folder).match;
  return match == Match::name || match == Match::content;
}

std::vector<fs::path> volumesIn(const fs::path& folder, const OpenOptions& options) {
  std::error_code failed;
  FolderSearch search{folder, options, fs::canonical(folder, failed)};
  search.descend(folder);
  return std::move(search.found);
}

}  // namespace scolopax::io
