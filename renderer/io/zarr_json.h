// SPDX-License-Identifier: Apache-2.0
// JSON documents of a Zarr store, and their fields, whose errors tell where they stand.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "renderer/io/zarr_store.h"

namespace scolopax::io {

/// The document of a key; none if there is no such key. Throws Error: badInput unless it is a JSON object
/// that is nested less than 32 deep; tooLarge beyond 8 MiB.
std::optional<nlohmann::json> readZarrJson(const ZarrStore& store, const std::string& key);

/// A value of a document, and the words that lead there: "a.zarr/.zattrs: multiscales[0].axes". Borrows the
/// document. Functions that read throw Error(badInput), with these words, unless they find what they expect.
class ZarrField {
 public:
  ZarrField(const nlohmann::json& value, std::string where) : value_(&value), where_(std::move(where)) {}

  /// Whether the field is there and not null.
  bool exists() const { return !value_->is_null(); }
  bool isText() const { return value_->is_string(); }
  bool isObject() const { return value_->is_object(); }
  const nlohmann::json& value() const { return *value_; }
  const std::string& where() const { return where_; }

  /// A field of an object, null if it is absent.
  ZarrField operator[](const std::string& name) const;
  /// The elements of a list of at most `most`.
  std::vector<ZarrField> list(std::size_t most) const;
  std::string text() const;
  std::int64_t integer(std::int64_t least, std::int64_t most) const;
  /// A finite number.
  double number() const;
  std::vector<std::int64_t> integers(std::size_t most, std::int64_t least, std::int64_t largest) const;

  /// Throw "WHERE: expected EXPECTED, found ...", as badInput and unsupported.
  [[noreturn]] void refuse(const std::string& expected) const;
  [[noreturn]] void refuseUnsupported(const std::string& expected) const;

 private:
  std::string found() const;

  const nlohmann::json* value_;
  std::string where_;
};

}  // namespace scolopax::io
