// SPDX-License-Identifier: Apache-2.0
// The built page: files below one folder, and nothing outside it.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "server/net/message.h"

namespace scolopax::net {

class StaticFiles {
 public:
  /// With an empty `root` there are no files. Throws NetError if it is not a folder.
  explicit StaticFiles(const std::string& root);

  /// The existing regular file that a decoded request path names ("/" is index.html), or nullopt; nullopt
  /// also for hidden names, "..", and links that lead out of the folder.
  std::optional<std::filesystem::path> find(const std::string& path) const;

  /// The file with its type, ETag and caching rule: files in assets/, whose names contain a content hash, are
  /// cached for good; all others are revalidated each time, and answered with 304 if unchanged.
  Response respond(const std::filesystem::path& file, const Request& request) const;

 private:
  std::filesystem::path root_;
};

}  // namespace scolopax::net
