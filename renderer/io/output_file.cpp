// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

Error failed(const fs::path& path, int number) {
  return {ErrorCode::io, shown(path) + ": cannot be written: " + std::generic_category().message(number)};
}

fs::path folderOf(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

bool folderIsWritable(const fs::path& path) { return access(folderOf(path).c_str(), W_OK | X_OK) == 0; }

/// Writes all parts to an open file and closes it. Returns the error number, 0 for none.
int writeAndClose(int file, std::span<const std::string_view> parts) {
  int error = 0;
  for (std::string_view bytes : parts) {
    while (!bytes.empty() && error == 0) {
      const ssize_t count = ::write(file, bytes.data(), bytes.size());
      if (count >= 0)
        bytes.remove_prefix(std::size_t(count));
      else if (errno != EINTR)
        error = errno;
    }
  }
  if (close(file) != 0 && error == 0) error = errno;  // network file systems may report errors only now
  return error;
}

}  // namespace

void checkWritable(const fs::path& path) {
  struct stat found;
  if (stat(path.c_str(), &found) == 0) {
    if (S_ISDIR(found.st_mode)) throw failed(path, EISDIR);
    if (access(path.c_str(), W_OK) != 0) throw failed(path, errno);
  } else if (errno != ENOENT || !path.has_filename()) {
    throw failed(path, errno);
  } else if (!folderIsWritable(path)) {
    throw failed(path, errno);
  }
}

void writeFile(const fs::path& path, std::string_view bytes) { writeFile(path, std::span(&bytes, 1)); }

void writeFile(const fs::path& path, std::span<const std::string_view> parts) {
  checkWritable(path);
  std::error_code ignored;
  // If the path is a link, replace the file it points to, not the link.
  const fs::path target = fs::is_symlink(path, ignored) ? fs::weakly_canonical(path, ignored) : path;
  struct stat old;
  const bool exists = stat(target.c_str(), &old) == 0;
  if (target.empty() || (exists && !S_ISREG(old.st_mode)) || !folderIsWritable(target)) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) throw failed(path, errno);
    if (const int error = writeAndClose(file, parts)) throw failed(path, error);
    return;
  }
  const fs::path temporary = folderOf(target) / (".scolopax-" + std::to_string(getpid()) + ".part");
  const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0) throw failed(path, errno);
  if (exists) [[maybe_unused]]
    const int kept = fchmod(file, old.st_mode & 07777);
  int error = writeAndClose(file, parts);
  if (error == 0 && rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return;
  unlink(temporary.c_str());
  throw failed(path, error);
}

}  // namespace scolopax::io
