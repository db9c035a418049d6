// SPDX-License-Identifier: Apache-2.0
// Where the documents and chunks of a Zarr hierarchy lie: keys, and a few bytes for each. Between folders,
// archives and servers on one side and the reader of arrays on the other.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace scolopax::io {

/// Part of a value: `size` bytes from `offset` on, or its last ones.
struct ZarrRange {
  std::uint64_t offset = 0;
  std::uint64_t size = 0;
  bool last = false;  ///< the last `size` bytes; `offset` is 0
};

/// Functions may be called from several threads at once.
class ZarrStore {
 public:
  virtual ~ZarrStore() = default;
  /// The value of a key, or none if there is no such key. Throws Error: tooLarge, before memory is taken, if
  /// it has more than `most` bytes; io if it cannot be read.
  virtual std::optional<std::vector<std::byte>> get(const std::string& key, std::uint64_t most) const = 0;
  /// Part of a value, or none if there is no such key. Throws also Error(badInput) if the value ends before
  /// the range does. `range.size` is what the caller has memory for.
  virtual std::optional<std::vector<std::byte>> getRange(const std::string& key,
                                                         const ZarrRange& range) const = 0;
  /// Names of what lies directly in a group, sorted; none if the store cannot tell.
  virtual std::vector<std::string> list(const std::string& group) const = 0;

  /// A key for messages: "a.zarr/0/.zarray".
  std::string shownKey(const std::string& key) const;

 protected:
  explicit ZarrStore(std::string name) : name_(std::move(name)) {}

 private:
  std::string name_;
};

/// Joins paths inside a store; each may be "".
std::string joinZarrPath(std::string_view group, std::string_view name);
/// A path that a document names, without "." and superfluous "/"; none if it has "..".
std::optional<std::string> cleanZarrPath(std::string_view path);

/// A folder. Links that lead out of it are refused.
std::unique_ptr<ZarrStore> openZarrFolder(const std::filesystem::path& folder);

/// A ZIP archive of stored or deflated entries, whose root or only folder is the root. Throws Error: badInput
/// for a damaged archive, unsupported if the build lacks libzip.
std::unique_ptr<ZarrStore> openZarrZip(const std::filesystem::path& path);

/// A server: "https://host/a.zarr". Hosts other than the allowed ones ("host", for the usual port, or
/// "host:port") are not asked, and redirections only followed on the same host. Throws Error: badInput for
/// other URLs, unsupported for other hosts or if the build lacks libcurl. Its functions throw also io for
/// what fails or takes longer than five minutes, and cancelled.
std::unique_ptr<ZarrStore> openZarrHttp(const std::string& url, const std::vector<std::string>& allowedHosts,
                                        std::stop_token stop);

}  // namespace scolopax::io
