// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_json.h"

#include <cmath>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {

std::optional<nlohmann::json> readZarrJson(const ZarrStore& store, const std::string& key) {
  constexpr std::uint64_t kMostBytes = 8 << 20;
  constexpr int kMostNested = 32;
  const auto bytes = store.get(key, kMostBytes);
  if (!bytes) return std::nullopt;
  const auto* text = reinterpret_cast<const char*>(bytes->data());
  const auto checkDepth = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    if (depth > kMostNested)
      throw Error(ErrorCode::badInput, store.shownKey(key) + ": expected JSON nested less than " +
                                           std::to_string(kMostNested) + " deep, found more");
    return true;
  };
  try {
    auto document = nlohmann::json::parse(text, text + bytes->size(), checkDepth);
    if (document.is_object()) return document;
  } catch (const nlohmann::json::parse_error& error) {
    throw Error(ErrorCode::badInput, store.shownKey(key) + ": expected JSON, found something else at byte " +
                                         std::to_string(error.byte));
  } catch (const nlohmann::json::exception&) {  // a number beyond the range
  }
  throw Error(ErrorCode::badInput, store.shownKey(key) + ": expected a JSON object, found something else");
}

ZarrField ZarrField::operator[](const std::string& name) const {
  static const nlohmann::json kNull;
  const bool named = where_.ends_with(' ');
  if (exists() && !value_->is_object()) refuse("an object");
  const auto found = exists() ? value_->find(name) : value_->end();
  return {found == value_->end() ? kNull : *found, where_ + (named ? "" : ".") + name};
}

std::vector<ZarrField> ZarrField::list(std::size_t most) const {
  if (!value_->is_array()) refuse("a list");
  if (value_->size() > most)
    throw Error(ErrorCode::badInput, where_ + ": expected at most " + std::to_string(most) +
                                         " elements, found " + std::to_string(value_->size()));
  std::vector<ZarrField> elements;
  for (std::size_t i = 0; i < value_->size(); ++i)
    elements.emplace_back((*value_)[i], where_ + "[" + std::to_string(i) + "]");
  return elements;
}

std::string ZarrField::text() const {
  if (!isText()) refuse("text");
  return value_->get<std::string>();
}

std::int64_t ZarrField::integer(std::int64_t least, std::int64_t most) const {
  const bool fits = value_->is_number_unsigned() ? value_->get<std::uint64_t>() <= std::uint64_t(INT64_MAX)
                                                 : value_->is_number_integer();
  const std::int64_t number = fits ? value_->get<std::int64_t>() : 0;
  if (!fits || number < least || number > most)
    refuse("a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  return number;
}

double ZarrField::number() const {
  const double number = value_->is_number() ? value_->get<double>() : std::nan("");
  if (!std::isfinite(number)) refuse("a number");
  return number;
}

std::vector<std::int64_t> ZarrField::integers(std::size_t most, std::int64_t least,
                                              std::int64_t largest) const {
  std::vector<std::int64_t> numbers;
  for (const ZarrField& element : list(most)) numbers.push_back(element.integer(least, largest));
  return numbers;
}

std::string ZarrField::found() const {
  if (value_->is_null()) return "none";
  if (value_->is_string()) return inQuotes(value_->get_ref<const std::string&>());
  if (value_->is_array()) return "a list of " + std::to_string(value_->size());
  return value_->is_object() ? "an object" : value_->dump();
}

void ZarrField::refuse(const std::string& expected) const {
  throw Error(ErrorCode::badInput, where_ + ": expected " + expected + ", found " + found());
}

void ZarrField::refuseUnsupported(const std::string& expected) const {
  throw Error(ErrorCode::unsupported, where_ + ": expected " + expected + ", found " + found());
}

}  // namespace scolopax::io
