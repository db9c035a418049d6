// SPDX-License-Identifier: Apache-2.0
#include "protocol/read_fields.h"

#include <algorithm>

namespace scolopax::protocol {
namespace {

/// "0.5", "100", "1e+30".
std::string shortNumber(double value) {
  std::string text = nlohmann::json(value).dump();
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

std::size_t codePoints(std::string_view utf8) {
  return std::size_t(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string quotedNames(const std::vector<EnumEntry>& names) {
  std::string text;
  for (const EnumEntry& entry : names) text += (text.empty() ? "\"" : ", \"") + entry.name + '"';
  return text;
}

bool isName(const std::vector<EnumEntry>& names, const std::string& text) {
  return std::any_of(names.begin(), names.end(), [&](const EnumEntry& entry) { return entry.name == text; });
}

void readColor(const nlohmann::json& json, const Path& path, std::string& out) {
  if (!json.is_string() || !isColor(json.get_ref<const std::string&>())) {
    failExpected(path, "a colour \"#rrggbb\"", json);
  }
  out = json.get<std::string>();
}

/// A list of [position, value] pairs whose positions lie in [0,1] and do not decrease.
template <class Point, class ReadSecond>
void readPoints(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
                const char* expected, std::vector<Point>& out, ReadSecond&& readSecond) {
  constexpr Traits kUnit{.atLeast = 0, .atMost = 1};
  if (!json.is_array()) failExpected(path, expected, json);
  if (json.empty() || json.size() > traits.maxItems) {
    failExpected(path, "1 to " + std::to_string(traits.maxItems) + " control points", json);
  }
  out.resize(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) {
    const Path point = path / i;
    if (!json[i].is_array() || json[i].size() != 2) failExpected(point, expected, json[i]);
    readValue(json[i][0], point / std::size_t{0}, kUnit, context, out[i].position);
    if (i > 0 && out[i].position < out[i - 1].position) {
      failExpected(point / std::size_t{0},
                   "a position that does not decrease (>= " + shortNumber(out[i - 1].position) + ")",
                   json[i][0]);
    }
    readSecond(json[i][1], point / std::size_t{1}, kUnit, out[i]);
  }
}

/// The points as [position, second].
template <class Point, class Second>
nlohmann::json pairs(const std::vector<Point>& points, Second Point::*second) {
  nlohmann::json::array_t list;
  list.reserve(points.size());
  for (const Point& point : points) {
    nlohmann::json::array_t pair;
    pair.reserve(2);
    pair.emplace_back(point.position);
    pair.emplace_back(point.*second);
    list.emplace_back(std::move(pair));
  }
  return list;
}

}  // namespace

bool isColor(std::string_view text) {
  const auto isHex = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
  };
  return text.size() == 7 && text[0] == '#' && std::all_of(text.begin() + 1, text.end(), isHex);
}

bool within(double value, const Traits& traits) {
  return !(traits.atLeast && value < *traits.atLeast) && !(traits.above && value <= *traits.above) &&
         !(traits.atMost && value > *traits.atMost) && !(traits.below && value >= *traits.below);
}

std::string expectedNumber(std::string_view kind, const Traits& traits) {
  std::string text(kind);
  const char* joint = " ";
  const auto add = [&](const char* sign, const std::optional<double>& bound) {
    if (!bound) return;
    text += joint + std::string(sign) + ' ' + shortNumber(*bound);
    joint = " and ";
  };
  add(">=", traits.atLeast);
  add(">", traits.above);
  add("<=", traits.atMost);
  add("<", traits.below);
  return text;
}

void readValue(const nlohmann::json& json, const Path& path, const Traits&, ReadContext, bool& out) {
  if (!json.is_boolean()) failExpected(path, "true or false", json);
  out = json.get<bool>();
}

void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext, double& out) {
  const double value = json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(value) || !within(value, traits))
    failExpected(path, expectedNumber("a number", traits), json);
  out = value;
}

void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext,
               std::uint32_t& out) {
  // 512.0 is an integer too, as in JSON Schema; every unsigned 32-bit number is exact in a double.
  const double value = json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
  const bool fits =
      value >= 0 && value <= std::numeric_limits<std::uint32_t>::max() && value == std::floor(value);
  if (!fits || !within(value, traits)) failExpected(path, expectedNumber("an integer", traits), json);
  out = static_cast<std::uint32_t>(value);
}

void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::string& out) {
  if (traits.color) return readColor(json, path, out);
  if (!json.is_string()) failExpected(path, "a string", json);
  const auto& text = json.get_ref<const std::string&>();
  if (traits.names != nullptr && !isName(context.lists.*traits.names, text)) {
    failExpected(path, "one of " + quotedNames(context.lists.*traits.names), json);
  }
  if (traits.maxLength > 0 && codePoints(text) > traits.maxLength) {
    failExpected(path, "at most " + std::to_string(traits.maxLength) + " characters", json);
  }
  out = text;
}

void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               std::vector<ControlPoint>& out) {
  readPoints(json, path, traits, context, "control points [position, value]", out,
             [&](const nlohmann::json& second, const Path& at, const Traits& unit, ControlPoint& point) {
               readValue(second, at, unit, context, point.value);
             });
}

void readValue(const nlohmann::json& json, const Path& path, const Traits& traits, ReadContext context,
               Colormap& out) {
  if (json.is_string()) {
    std::string name;
    readValue(json, path, {.names = traits.names}, context, name);
    out = std::move(name);
    return;
  }
  std::vector<ColorPoint> points;
  readPoints(json, path, traits, context, "the name of a colormap or control points [position, \"#rrggbb\"]",
             points, [&](const nlohmann::json& second, const Path& at, const Traits&, ColorPoint& point) {
               readColor(second, at, point.color);
             });
  out = std::move(points);
}

nlohmann::json writeValue(const std::vector<ControlPoint>& value) {
  return pairs(value, &ControlPoint::value);
}

nlohmann::json writeValue(const Colormap& value) {
  if (const auto* name = std::get_if<std::string>(&value)) return *name;
  return pairs(std::get<std::vector<ColorPoint>>(value), &ColorPoint::color);
}

}  // namespace scolopax::protocol
