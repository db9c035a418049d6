// SPDX-License-Identifier: Apache-2.0
// The fuzz target of one format, whose match function is SCOLOPAX_FUZZ_MATCH. The input is one file; or
// several, each after a line "=== NAME", for formats of folders and of headers that name other files.
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;

/// A folder of this process, which is removed when the process ends.
const fs::path& folder() {
  struct Folder {
    fs::path path;
    Folder() {
      std::string pattern = (fs::temp_directory_path() / "scolopax-fuzz-XXXXXX").string();
      path = ::mkdtemp(pattern.data());
    }
    ~Folder() { fs::remove_all(path); }
  };
  static const Folder folder;
  return folder.path;
}

void writeFile(const fs::path& path, std::string_view bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  const bool written = fd >= 0 && ::write(fd, bytes.data(), bytes.size()) == ssize_t(bytes.size());
  if (fd >= 0) ::close(fd);
  if (!written) ::abort();
}

/// Whether the name stays in the folder and can be one.
bool isUsable(const fs::path& name) {
  return !name.empty() && name.is_relative() && name.string().size() < 100 && name.has_filename() &&
         name.string().find('\0') == std::string::npos &&
         std::ranges::none_of(name, [](const fs::path& part) { return part == ".." || part == "."; });
}

/// Writes the files of the input; returns the first one.
fs::path unpack(std::string_view input) {
  constexpr std::string_view kMark = "=== ";
  constexpr int kMostFiles = 64;
  fs::remove_all(folder());
  fs::create_directory(folder());
  if (!input.starts_with(kMark)) {
    writeFile(folder() / "a", input);
    return folder() / "a";
  }
  fs::path first;
  for (int files = 0; input.starts_with(kMark) && files < kMostFiles; ++files) {
    const std::size_t line = std::min(input.find('\n'), input.size());
    const fs::path name(std::string(input.substr(kMark.size(), line - std::min(line, kMark.size()))));
    input.remove_prefix(std::min(line + 1, input.size()));
    const std::size_t next = input.find("\n=== ");
    const std::string_view bytes = input.substr(0, next);
    input.remove_prefix(next == std::string_view::npos ? input.size() : next + 1);
    std::error_code failed;
    if (!isUsable(name)) continue;
    fs::create_directories((folder() / name).parent_path(), failed);
    if (failed || fs::exists(folder() / name, failed)) continue;
    writeFile(folder() / name, bytes);
    if (first.empty()) first = folder() / name;
  }
  return first;
}

/// Any result other than volumes or an Error is a finding. Volumes are also measured.
void loadAll(const Format& format, const fs::path& path) {
  constexpr std::uint64_t kLimit = std::uint64_t(64) << 20;
  constexpr std::size_t kMostVolumes = 4;
  const auto file = openFile(format, path);
  for (std::size_t i = 0; i < std::min(file->volumes.size(), kMostVolumes); ++i) {
    const VolumeInfo& volume = file->volumes[i];
    for (const auto& [level, time] :
         {std::pair{std::size_t(0), std::size_t(0)}, {volume.levels.size() - 1, volume.times.count - 1}}) {
      try {
        Part part{.volume = i, .level = level, .time = time};
        for (std::size_t c = 0; c < std::min<std::size_t>(volume.channels.size(), 32); ++c)
          part.channels.push_back(c);
        LoadedPart loaded = load(*file, part, LoadOptions{.memoryLimitBytes = kLimit});
        const Volume measured(loaded.grid, std::move(loaded.channels));
      } catch (const Error&) {  // the others may be sound
      }
    }
  }
}

}  // namespace
}  // namespace scolopax::io

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace scolopax::io;
  static const Format& format = *std::ranges::find(formats(), &SCOLOPAX_FUZZ_MATCH, &Format::match);
  const fs::path first = unpack({reinterpret_cast<const char*>(bytes), size});
  try {
    const bool wholeFolder = format.match({.path = folder(), .folder = true}) != Match::no;
    if (wholeFolder || !first.empty()) loadAll(format, wholeFolder ? folder() : first);
  } catch (const scolopax::Error&) {
  }
  return 0;
}
