// SPDX-License-Identifier: Apache-2.0
// The files generated from the table of fields are up to date in the repository, and the schema agrees with
// what the parser accepts. SCOLOPAX_UPDATE=1 rewrites the files.
#include "protocol/schema.h"

#include <gtest/gtest.h>

#include "protocol/fields.h"
#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "renderer/data/volume.h"
#include "server/scene_resolver.h"
#include "tests/protocol/fixtures.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

const json& schema() {
  static const json parsed = json::parse(schemaText(server::rendererLists()));
  return parsed;
}

/// The reference to an object in a field's schema, even if the field may be null; null if there is none.
json referenceIn(const json& field) {
  if (field.contains("$ref")) return field;
  const json choices = field.value("anyOf", json::array());
  return !choices.empty() && choices[0].contains("$ref") ? choices[0] : json();
}

/// Calls f(path of the field in a scene, its schema) for every field that is neither an object nor a list of
/// objects.
template <class F>
void forEachSchemaField(const json& object, const json::json_pointer& at, const F& f) {
  for (const auto& [name, field] : object["properties"].items()) {
    const json::json_pointer path = at / name;
    const auto definition = [](const json& reference) {
      return schema().at(json::json_pointer(reference["$ref"].get<std::string>().substr(1)));
    };
    if (const json reference = referenceIn(field); !reference.is_null())
      forEachSchemaField(definition(reference), path, f);
    else if (name == "channels")
      forEachSchemaField(definition(field["items"]), path / 0, f);
    else
      f(path, field);
  }
}

/// A scene in which only one value is set.
json sceneWith(const json::json_pointer& path, const json& value) {
  json scene = json::object();
  if (path.to_string().rfind("/channels", 0) == 0) scene["channels"] = json::array();
  scene[path] = value;
  return scene;
}

bool isTaken(const json::json_pointer& path, const json& value) {
  try {
    parseScene(sceneWith(path, value), server::rendererLists());
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.pointer, path.to_string());
    return false;
  }
  return true;
}

TEST(Schema, IsTheOneInTheRepository) {
  expectFile(protocolFile("schema.json"), schemaText(server::rendererLists()));
}

TEST(Schema, ListsAsManyChannelsAsAVolumeMayHave) { EXPECT_EQ(std::size_t{kMaxChannels}, kMaxChannelItems); }

TEST(Schema, SaysHowManySamplesASceneWithoutAStopRuleGets) {
  EXPECT_NE(Table<Stop>::doc.find(std::to_string(server::kRenderSamples) + " samples in a render and " +
                                  std::to_string(server::kSessionSamples) + " in a session"),
            std::string_view::npos);
}

TEST(Schema, GivesEveryFieldADescriptionAndADefaultThatIsTaken) {
  int fields = 0;
  forEachSchemaField(schema(), json::json_pointer(), [&](const json::json_pointer& path, const json& field) {
    SCOPED_TRACE(path.to_string());
    EXPECT_FALSE(field.value("description", "").empty());
    ASSERT_TRUE(field.contains("default"));
    EXPECT_TRUE(isTaken(path, field["default"]));
    ++fields;
  });
  EXPECT_EQ(fields, 46);
}

TEST(Schema, SaysOfAnObjectThatMayBeNullWhatItIsAndThatNullIsTheDefault) {
  const json& field = schema()["$defs"]["Channel"]["properties"]["gradientOpacity"];
  EXPECT_EQ(field["anyOf"], json::parse(R"([{"$ref": "#/$defs/GradientOpacity"}, {"type": "null"}])"));
  EXPECT_FALSE(field.value("description", "").empty());
  ASSERT_TRUE(field.contains("default"));
  EXPECT_TRUE(field["default"].is_null());
  const json::json_pointer path("/channels/0/gradientOpacity");
  EXPECT_TRUE(isTaken(path, nullptr));
  EXPECT_TRUE(isTaken(path, json::object()));
}

TEST(Schema, SaysTheSameOfBoundsAsReadingDoes) {
  int bounds = 0;
  forEachSchemaField(schema(), json::json_pointer(), [&](const json::json_pointer& path, const json& field) {
    SCOPED_TRACE(path.to_string());
    const auto check = [&](const char* keyword, bool takenAt, double beyond) {
      if (!field.contains(keyword)) return;
      const double bound = field[keyword];
      EXPECT_EQ(isTaken(path, bound), takenAt) << keyword;
      EXPECT_FALSE(isTaken(path, bound + beyond * std::max(1.0, std::abs(bound)))) << keyword;
      ++bounds;
    };
    check("minimum", true, -1);
    check("exclusiveMinimum", false, -1);
    check("maximum", true, 1);
    check("exclusiveMaximum", false, 1);
  });
  EXPECT_EQ(bounds, 33);
}

TEST(Schema, SaysTheSameOfNullAndNamesAsReadingDoes) {
  forEachSchemaField(schema(), json::json_pointer(), [&](const json::json_pointer& path, const json& field) {
    SCOPED_TRACE(path.to_string());
    bool nullable = field.contains("type") && field["type"].is_array() && field["type"][1] == "null";
    for (const json& choice : field.value("anyOf", json::array()))
      nullable = nullable || choice["type"] == "null";
    EXPECT_EQ(isTaken(path, nullptr), nullable);
    for (const json& name : field.value("enum", json::array())) EXPECT_TRUE(isTaken(path, name)) << name;
    EXPECT_FALSE(isTaken(path, json::object()));
  });
}

}  // namespace
}  // namespace scolopax::protocol
