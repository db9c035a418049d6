// SPDX-License-Identifier: Apache-2.0
// Reads and writes structs that have a table of fields (fields.h), with one overload for each type of field.
// Internal to protocol/; scene_json.cpp and messages.cpp instantiate it.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/fields.h"
#include "protocol/path.h"

namespace scolopax::protocol {

/// The lists in which readValue looks up names.
struct ReadContext {
  const Lists& lists;
};

/// "a number > 0 and <= 100", in the unit of the field.
std::string expectedNumber(std::string_view kind, const Traits& traits);
bool isColor(std::string_view text);
bool within(double value, const Traits& traits);

// One overload per type of value; each reports errors with failExpected.
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               bool& out);
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               double& out);
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::uint32_t& out);
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::string& out);
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::vector<ControlPoint>& out);
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               Colormap& out);

template <class T>
constexpr std::string_view kPluralOf = "";
template <>
inline constexpr std::string_view kPluralOf<double> = "numbers";
template <>
inline constexpr std::string_view kPluralOf<bool> = "booleans";
template <>
inline constexpr std::string_view kPluralOf<std::uint32_t> = "integers";

template <class T, std::size_t N>
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::array<T, N>& out) {
  if (!json.is_array() || json.size() != N)
    failExpected(path, "a list of " + std::to_string(N) + " " + std::string(kPluralOf<T>), json);
  for (std::size_t i = 0; i < N; ++i) readValue(json[i], path / i, traits, context, out[i]);
}

inline void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
                      std::vector<std::uint32_t>& out) {
  if (!json.is_array() || json.size() > traits.maxItems)
    failExpected(path, "a list of at most " + std::to_string(traits.maxItems) + " integers", json);
  out.resize(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) readValue(json[i], path / i, traits, context, out[i]);
}

template <class T>
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::optional<T>& out) {
  if (json.is_null()) {
    out.reset();
    return;
  }
  out.emplace();
  readValue(json, path, traits, context, *out);
}

template <Described T>
void readStruct(const nlohmann::json& json, const Path& path, ReadContext context, T& out);

template <Described T>
void readValue(const nlohmann::json& json, const Path& path, const Traits&, ReadContext context, T& out) {
  readStruct(json, path, context, out);
}

template <Described T>
void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::vector<T>& out) {
  if (!json.is_array()) failExpected(path, "a list", json);
  if (json.size() > traits.maxItems)
    failExpected(path, "at most " + std::to_string(traits.maxItems) + " entries", json);
  out.resize(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) readStruct(json[i], path / i, context, out[i]);
}

/// Throws ProtocolError(422) if the object has a member that is not in the table.
template <Described T>
void refuseUnknown(const nlohmann::json& object, const Path& path) {
  for (auto member = object.begin(); member != object.end(); ++member) {
    const std::string& key = member.key();
    bool known = false;
    forEachField<T>([&](const auto& field) { known = known || field.name == key; });
    if (!known) {
      std::string names;
      forEachField<T>(
          [&](const auto& field) { names += (names.empty() ? "" : ", ") + std::string(field.name); });
      fail(path / key, "unknown field; expected one of " + names);
    }
  }
}

template <Described T>
void readStruct(const nlohmann::json& json, const Path& path, ReadContext context, T& out) {
  if (!json.is_object()) failExpected(path, "an object", json);
  refuseUnknown<T>(json, path);
  forEachField<T>([&](const auto& field) {
    const auto found = json.find(field.name);
    if (found != json.end()) readValue(*found, path / field.name, field.traits, context, out.*field.member);
  });
  const auto set = [&](std::string_view key) {
    return json.contains(key) && !json.at(std::string(key)).is_null();
  };
  forEachExclusive<T>([&](const Exclusive& pair) {
    if (pair.bothAreAnError && set(pair.first) && set(pair.second)) {
      fail(path / pair.second, "cannot be set together with " + std::string(pair.first));
    }
  });
}

inline nlohmann::json writeValue(bool value) { return value; }
inline nlohmann::json writeValue(double value) { return value; }
inline nlohmann::json writeValue(std::uint32_t value) { return value; }
inline nlohmann::json writeValue(const std::string& value) { return value; }
nlohmann::json writeValue(const std::vector<ControlPoint>& value);
nlohmann::json writeValue(const Colormap& value);
template <class T, std::size_t N>
nlohmann::json writeValue(const std::array<T, N>& value) {
  return value;
}
inline nlohmann::json writeValue(const std::vector<std::uint32_t>& value) { return value; }
template <class T>
nlohmann::json writeValue(const std::optional<T>& value) {
  return value ? writeValue(*value) : nlohmann::json();
}
template <Described T>
nlohmann::json writeValue(const T& value);
template <Described T>
nlohmann::json writeValue(const std::vector<T>& value) {
  nlohmann::json list = nlohmann::json::array();
  for (const T& element : value) list.push_back(writeValue(element));
  return list;
}

/// Omits fields without a value, so the result contains no null.
template <Described T>
nlohmann::json writeValue(const T& value) {
  nlohmann::json object = nlohmann::json::object();
  forEachField<T>([&](const auto& field) {
    nlohmann::json member = writeValue(value.*field.member);
    if (!member.is_null()) object[std::string(field.name)] = std::move(member);
  });
  return object;
}

}  // namespace scolopax::protocol
