// SPDX-License-Identifier: Apache-2.0
#include "protocol/schema.h"

#include "protocol/read_fields.h"

namespace scolopax::protocol {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
struct Tag {};

/// Shared by the functions below: the definitions collected so far, and the names of enums.
struct Writer {
  const Lists& lists;
  Json definitions = Json::object();
};

std::string text(std::string_view view) { return std::string(view); }

/// Writes whole numbers without a decimal point.
Json tidyNumber(double value) {
  constexpr double kExact = 9007199254740992.0;  // 2^53
  if (value == std::floor(value) && std::abs(value) < kExact) return static_cast<std::int64_t>(value);
  return value;
}

Json tidy(const nlohmann::json& value) {
  if (value.is_number_float()) return tidyNumber(value.get<double>());
  if (!value.is_array()) return value;
  Json list = Json::array();
  for (const auto& element : value) list.push_back(tidy(element));
  return list;
}

Json numberSchema(const char* type, const Traits& traits) {
  Json schema{{"type", type}};
  if (traits.atLeast) schema["minimum"] = tidyNumber(*traits.atLeast);
  if (traits.above) schema["exclusiveMinimum"] = tidyNumber(*traits.above);
  if (traits.atMost) schema["maximum"] = tidyNumber(*traits.atMost);
  if (traits.below) schema["exclusiveMaximum"] = tidyNumber(*traits.below);
  return schema;
}

Json colorSchema() { return {{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}$"}}; }

Json nameSchema(const std::vector<EnumEntry>& names) {
  Json values = Json::array();
  for (const EnumEntry& entry : names) values.push_back(entry.name);
  return {{"type", "string"}, {"enum", values}};
}

Json reference(std::string_view title) { return {{"$ref", "#/$defs/" + text(title)}}; }

Json pointList(std::string_view title, const Traits& traits) {
  return {{"type", "array"}, {"items", reference(title)}, {"minItems", 1}, {"maxItems", traits.maxItems}};
}

// One overload for each type of field. The overloads of valueWords further below describe the same types in
// words.
Json valueSchema(Tag<bool>, const Traits&, Writer&) { return {{"type", "boolean"}}; }
Json valueSchema(Tag<double>, const Traits& traits, Writer&) { return numberSchema("number", traits); }
Json valueSchema(Tag<std::uint32_t>, const Traits& traits, Writer&) {
  return numberSchema("integer", traits);
}
Json valueSchema(Tag<std::string>, const Traits& traits, Writer& writer) {
  if (traits.color) return colorSchema();
  if (traits.names != nullptr) return nameSchema(writer.lists.*traits.names);
  return {{"type", "string"}, {"maxLength", traits.maxLength}};
}
template <class T, std::size_t N>
Json valueSchema(Tag<std::array<T, N>>, const Traits& traits, Writer& writer) {
  return {
      {"type", "array"}, {"items", valueSchema(Tag<T>{}, traits, writer)}, {"minItems", N}, {"maxItems", N}};
}
Json valueSchema(Tag<std::vector<std::uint32_t>>, const Traits& traits, Writer& writer) {
  return {{"type", "array"},
          {"items", valueSchema(Tag<std::uint32_t>{}, traits, writer)},
          {"maxItems", traits.maxItems}};
}
Json valueSchema(Tag<std::vector<ControlPoint>>, const Traits& traits, Writer& writer) {
  writer.definitions["ControlPoint"] = {
      {"title", "ControlPoint"}, {"description", "[position, value], both in [0,1]."},
      {"type", "array"},         {"items", {{"type", "number"}, {"minimum", 0}, {"maximum", 1}}},
      {"minItems", 2},           {"maxItems", 2}};
  return pointList("ControlPoint", traits);
}
// tsType is for json-schema-to-typescript, which does not support prefixItems.
Json valueSchema(Tag<Colormap>, const Traits& traits, Writer& writer) {
  const Json position{{"type", "number"}, {"minimum", 0}, {"maximum", 1}};
  writer.definitions["ColorPoint"] = {{"title", "ColorPoint"},
                                      {"description", "[position, colour], position in [0,1]."},
                                      {"type", "array"},
                                      {"prefixItems", Json::array({position, colorSchema()})},
                                      {"minItems", 2},
                                      {"maxItems", 2},
                                      {"tsType", "[number, string]"}};
  return {{"anyOf", Json::array({nameSchema(writer.lists.*traits.names), pointList("ColorPoint", traits)})}};
}
template <Described T>
Json structSchema(Writer& writer);
template <Described T>
Json valueSchema(Tag<T>, const Traits&, Writer& writer) {
  writer.definitions[text(Table<T>::title)] = structSchema<T>(writer);
  return reference(Table<T>::title);
}
template <Described T>
Json valueSchema(Tag<std::vector<T>>, const Traits& traits, Writer& writer) {
  return {{"type", "array"}, {"items", valueSchema(Tag<T>{}, traits, writer)}, {"maxItems", traits.maxItems}};
}
template <class T>
Json valueSchema(Tag<std::optional<T>>, const Traits& traits, Writer& writer) {
  Json schema = valueSchema(Tag<T>{}, traits, writer);
  if (schema.contains("$ref")) schema = Json{{"anyOf", Json::array({schema})}};
  if (schema.contains("anyOf"))
    schema["anyOf"].push_back({{"type", "null"}});
  else
    schema["type"] = Json::array({schema["type"], "null"});
  if (schema.contains("enum")) schema["enum"].push_back(nullptr);
  return schema;
}

/// The field's meaning, unit and names in one text.
std::string description(std::string_view doc, const Traits& traits, const Lists& lists) {
  std::string words = text(doc);
  if (!traits.unit.empty()) words += " Unit: " + text(traits.unit) + '.';
  if (traits.names != nullptr) {
    for (const EnumEntry& entry : lists.*traits.names) words += "\n- " + entry.name + ": " + entry.doc;
  }
  return words;
}

template <Described T>
Json structSchema(Writer& writer) {
  Json properties = Json::object();
  forEachField<T>([&]<class Value>(const Field<T, Value>& field) {
    Json schema = valueSchema(Tag<Value>{}, field.traits, writer);
    // A $ref has no other keywords: the referenced definition has its own description, and the default is {}.
    if (!schema.contains("$ref")) {
      schema["description"] = description(field.doc, field.traits, writer.lists);
      schema["default"] = tidy(writeValue(T{}.*field.member));
    }
    properties[text(field.name)] = std::move(schema);
  });
  Json schema{{"title", Table<T>::title},
              {"description", Table<T>::doc},
              {"type", "object"},
              {"additionalProperties", false},
              {"properties", properties}};
  forEachExclusive<T>([&](const Exclusive& pair) {
    if (!pair.bothAreAnError) return;
    // In this form, because generators of types ignore the contents of a `not`.
    const Json isSet{{"not", {{"type", "null"}}}};
    schema["not"] = {{"required", Json::array({pair.first, pair.second})},
                     {"properties", {{text(pair.first), isSet}, {text(pair.second), isSet}}}};
  });
  return schema;
}

std::string valueWords(Tag<bool>, const Traits&) { return "true or false"; }
std::string valueWords(Tag<double>, const Traits& traits) { return expectedNumber("number", traits); }
std::string valueWords(Tag<std::uint32_t>, const Traits& traits) { return expectedNumber("integer", traits); }
std::string valueWords(Tag<std::string>, const Traits& traits) {
  if (traits.color) return "`\"#rrggbb\"`";
  if (traits.names != nullptr) return "name";
  return "text, at most " + std::to_string(traits.maxLength) + " characters";
}
template <class T, std::size_t N>
std::string valueWords(Tag<std::array<T, N>>, const Traits&) {
  return "list of " + std::to_string(N) + " " + text(kPluralOf<T>);
}
std::string valueWords(Tag<std::vector<std::uint32_t>>, const Traits& traits) {
  return "list of " + expectedNumber("integers", traits);
}
std::string valueWords(Tag<std::vector<ControlPoint>>, const Traits& traits) {
  return "`[[position, value], ...]`, 1 to " + std::to_string(traits.maxItems);
}
std::string valueWords(Tag<Colormap>, const Traits& traits) {
  return "name, or `[[position, \"#rrggbb\"], ...]`, 1 to " + std::to_string(traits.maxItems);
}
template <Described T>
std::string valueWords(Tag<T>, const Traits&) {
  return "object " + text(Table<T>::title);
}
template <Described T>
std::string valueWords(Tag<std::vector<T>>, const Traits& traits) {
  return "list of at most " + std::to_string(traits.maxItems) + " " + text(Table<T>::title);
}
template <class T>
std::string valueWords(Tag<std::optional<T>>, const Traits& traits) {
  return valueWords(Tag<T>{}, traits) + ", or null";
}

template <class T>
void appendTableOf(Tag<T>, std::string&, const Lists&) {}
template <Described T>
void appendTableOf(Tag<T>, std::string& out, const Lists& lists);
template <Described T>
void appendTableOf(Tag<std::vector<T>>, std::string& out, const Lists& lists) {
  appendTableOf(Tag<T>{}, out, lists);
}
template <Described T>
void appendTableOf(Tag<std::optional<T>>, std::string& out, const Lists& lists) {
  appendTableOf(Tag<T>{}, out, lists);
}

template <Described T>
void appendTableOf(Tag<T>, std::string& out, const Lists& lists) {
  out += "### " + text(Table<T>::title) + "\n\n" + text(Table<T>::doc) + "\n\n";
  out += "| field | value | unit | default | meaning |\n|---|---|---|---|---|\n";
  std::string names;
  forEachField<T>([&]<class Value>(const Field<T, Value>& field) {
    const std::string defaultText = Described<Value> ? "{}" : tidy(writeValue(T{}.*field.member)).dump();
    out += "| `" + text(field.name) + "` | " + valueWords(Tag<Value>{}, field.traits) + " | " +
           text(field.traits.unit) + " | `" + defaultText + "` | " + text(field.doc) + " |\n";
    if (field.traits.names == nullptr) return;
    names += "\nNames of `" + text(field.name) + "`:\n\n";
    for (const EnumEntry& entry : lists.*field.traits.names)
      names += "- `" + entry.name + "`: " + entry.doc + '\n';
  });
  out += names + '\n';
  forEachField<T>([&]<class Value>(const Field<T, Value>&) { appendTableOf(Tag<Value>{}, out, lists); });
}

}  // namespace

std::string schemaText(const Lists& lists) {
  Writer writer{lists};
  Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"}};
  schema.update(structSchema<Scene>(writer));
  schema["$defs"] = writer.definitions;
  return schema.dump(2) + '\n';
}

std::string fieldsMarkdown(const Lists& lists) {
  std::string out;
  appendTableOf(Tag<Scene>{}, out, lists);
  return out;
}

}  // namespace scolopax::protocol
