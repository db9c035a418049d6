// SPDX-License-Identifier: Apache-2.0
// The files of the built page, all below one folder.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "server/net/message.h"

namespace scolopax::net {

class StaticFiles {
 public:
  /// With an empty `root` there are no files. Throws NetError if `root` is not a folder.
  explicit StaticFiles(const std::string& root);

  /// The regular file at a decoded request path ("/" is index.html). nullopt if there is none, and for hidden
  /// names, "..", and links that lead out of the folder.
  std::optional<std::filesystem::path> find(const std::string& path) const;

  /// The file with its type, ETag and caching rule. Files in assets/, whose names contain a hash of their
  /// content, may be cached without limit. All others are revalidated each time and answered with 304 if
  /// unchanged.
  Response respond(const std::filesystem::path& file, const Request& request) const;

 private:
  std::filesystem::path root_;
};

}  // namespace scolopax::net
