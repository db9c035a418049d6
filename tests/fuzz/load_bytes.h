// SPDX-License-Identifier: Apache-2.0
// Shared by the fuzz targets of the loaders: loads bytes as a file with a given name, with a small memory
// limit.
#pragma once
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "renderer/core/error.h"
#include "renderer/io/format.h"

namespace scolopax::fuzz {

/// A folder of this process, which is removed when the process ends.
inline const std::filesystem::path& folder() {
  struct Folder {
    std::filesystem::path path;
    Folder() {
      std::string pattern = (std::filesystem::temp_directory_path() / "scolopax-fuzz-XXXXXX").string();
      path = ::mkdtemp(pattern.data());
    }
    ~Folder() { std::filesystem::remove_all(path); }
  };
  static const Folder folder;
  return folder.path;
}

inline void writeFile(const std::string& name, const std::uint8_t* bytes, std::size_t size) {
  const int fd = ::open((folder() / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const bool written = fd >= 0 && ::write(fd, bytes, size) == ssize_t(size);
  if (fd >= 0) ::close(fd);
  if (!written) ::abort();
}

/// Any result other than a volume or a scolopax::Error is a finding. A volume is also measured.
inline void load(const std::string& name) {
  constexpr std::uint64_t kLimit = std::uint64_t(64) << 20;
  const std::filesystem::path paths[] = {folder() / name};
  try {
    scolopax::io::loadDatasets(paths, kLimit, [](const std::string&) {});
  } catch (const scolopax::Error&) {
  }
}

inline int loadAs(const std::string& name, const std::uint8_t* bytes, std::size_t size) {
  writeFile(name, bytes, size);
  load(name);
  return 0;
}

}  // namespace scolopax::fuzz
