// SPDX-License-Identifier: Apache-2.0
// A position in a document, as a linked list on the stack, which is converted to a JSON pointer only to
// report an error; and the functions that throw such errors. Internal to protocol/.
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
  /// JSON pointer (RFC 6901).
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
/// Throws ProtocolError(422) whose detail is the pointer, a colon and the message.
[[noreturn]] void fail(const Path& path, std::string_view message);

}  // namespace scolopax::protocol
