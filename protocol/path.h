// SPDX-License-Identifier: Apache-2.0
// Where in a document one is, as a chain on the stack that becomes a JSON pointer only when something is
// wrong there; and the errors that name it. Internal to protocol/.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace scolopax::protocol {

class Path {
 public:
  Path() = default;
  /// The parent and the key must outlive the child.
  Path operator/(std::string_view key) const { return Path(this, key, std::nullopt); }
  Path operator/(std::size_t index) const { return Path(this, {}, index); }
  /// RFC 6901.
  std::string pointer() const;

 private:
  Path(const Path* parent, std::string_view key, std::optional<std::size_t> index)
      : parent_(parent), key_(key), index_(index) {}
  const Path* parent_ = nullptr;
  std::string_view key_;
  std::optional<std::size_t> index_;
};

/// Throws ProtocolError(422): "/channels/0/gamma: expected a number > 0, found -1".
[[noreturn]] void failExpected(const Path& path, std::string_view expected, const nlohmann::json& found);
/// Throws ProtocolError(422): pointer, colon, message.
[[noreturn]] void fail(const Path& path, std::string_view message);

}  // namespace scolopax::protocol
