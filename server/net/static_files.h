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
  /// `root` empty: there are none. Throws NetError when it is not a folder.
  explicit StaticFiles(const std::string& root);

  /// The existing regular file that a decoded request path names ("/" is index.html), or nullopt: also for
  /// hidden names, "..", and links that lead out of the folder.
  std::optional<std::filesystem::path> find(const std::string& path) const;

  /// The file with type, ETag and caching: names that carry a content hash (assets/) for good, others are
  /// asked for again each time and then answered by 304 when unchanged.
  Response respond(const std::filesystem::path& file, const Request& request) const;

 private:
  std::filesystem::path root_;
};

}  // namespace scolopax::net
