// SPDX-License-Identifier: Apache-2.0
// Patches: RFC 7396, list entries by index, pairs that exclude each other, and properties over random scenes.
#include "protocol/patch.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "server/scene_resolver.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

constexpr std::size_t kChannels = 4;

json applied(const char* scene, const char* patch) {
  return applyPatch(json::parse(scene), json::parse(patch), kChannels);
}

std::string refusedAt(const char* scene, const char* patch) {
  try {
    applied(scene, patch);
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    return error.pointer;
  }
  return "none";
}

TEST(ApplyPatch, SetsAndMerges) {
  EXPECT_EQ(
      applied(R"({"camera": {"fovY": 20, "eye": [0, 0, 1]}})", R"({"camera": {"fovY": 30}, "dataset": "a"})"),
      json::parse(R"({"camera": {"fovY": 30, "eye": [0, 0, 1]}, "dataset": "a"})"));
  EXPECT_EQ(applied("{}", "{}"), json::object());
}

TEST(ApplyPatch, RestoresDefaultsForNull) {
  EXPECT_EQ(applied(R"({"camera": {"fovY": 20}, "dataset": "a"})",
                    R"({"camera": {"fovY": null}, "dataset": null})"),
            json::parse(R"({"camera": {}})"));
  EXPECT_EQ(applied(R"({"camera": {"fovY": 20}})", R"({"camera": null})"), json::object());
  EXPECT_EQ(applied("{}", R"({"camera": {"fovY": null}})"), json::parse(R"({"camera": {}})"));
}

TEST(ApplyPatch, EditsOneChannelByItsIndex) {
  EXPECT_EQ(applied(R"({"channels": [{"gamma": 2}, {"gamma": 3, "visible": false}]})",
                    R"({"channels": {"1": {"gamma": 4}}})"),
            json::parse(R"({"channels": [{"gamma": 2}, {"gamma": 4, "visible": false}]})"));
}

TEST(ApplyPatch, LetsTwoViewersEditTwoChannelsInAnyOrder) {
  const char* red = R"({"channels": {"0": {"color": "#ff0000"}}})";
  const char* blue = R"({"channels": {"2": {"color": "#0000ff"}}})";
  const json expected = json::parse(R"({"channels": [{"color": "#ff0000"}, {}, {"color": "#0000ff"}]})");
  EXPECT_EQ(applied(applied("{}", red).dump().c_str(), blue), expected);
  EXPECT_EQ(applied(applied("{}", blue).dump().c_str(), red), expected);
}

TEST(ApplyPatch, MakesANullEntryAnEmptyOne) {
  EXPECT_EQ(applied(R"({"channels": [{"gamma": 2}]})", R"({"channels": {"0": null}})"),
            json::parse(R"({"channels": [{}]})"));
  EXPECT_EQ(applied("{}", R"({"channels": [null, {"gamma": 2, "color": null}]})"),
            json::parse(R"({"channels": [{}, {"gamma": 2}]})"));
}

TEST(ApplyPatch, ReplacesAListByAList) {
  EXPECT_EQ(applied(R"({"channels": [{"gamma": 2}, {"gamma": 3}]})", R"({"channels": [{"visible": false}]})"),
            json::parse(R"({"channels": [{"visible": false}]})"));
  EXPECT_EQ(applied(R"({"channels": [{"gamma": 2}]})", R"({"channels": null})"), json::object());
}

TEST(ApplyPatch, EditsEntriesOfPlainListsThatAreThere) {
  const char* scene = R"({"channels": [{"opacity": [[0, 0], [1, 1]], "range": [0, 10]}]})";
  EXPECT_EQ(applied(scene, R"({"channels": {"0": {"opacity": {"1": [0.9, 0.5]}, "range": {"0": 3}}}})"),
            json::parse(R"({"channels": [{"opacity": [[0, 0], [0.9, 0.5]], "range": [3, 10]}]})"));
  EXPECT_EQ(refusedAt(scene, R"({"channels": {"0": {"opacity": {"2": [1, 1]}}}})"), "/channels/0/opacity/2");
  EXPECT_EQ(refusedAt(scene, R"({"channels": {"0": {"opacity": {"0": null}}}})"), "/channels/0/opacity/0");
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"0": {"opacity": {"0": [0, 1]}}}})"), "/channels/0/opacity");
}

TEST(ApplyPatch, GrowsTheLightsUpToTheirNumber) {
  EXPECT_EQ(applied("{}", R"({"lights": {"1": {"intensity": 2}}})"),
            json::parse(R"({"lights": [{}, {"intensity": 2}]})"));
  EXPECT_EQ(applied(R"({"lights": [{"intensity": 2}]})", R"({"lights": {"0": null}})"),
            json::parse(R"({"lights": [{}]})"));
  EXPECT_EQ(refusedAt("{}", R"({"lights": {"8": {}}})"), "/lights/8");
}

TEST(ApplyPatch, RefusesIndicesThatAreNone) {
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"4": {}}})"), "/channels/4");
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"4": null}})"), "/channels/4");
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"999999999": {}}})"), "/channels/999999999");
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"18446744073709551616": {}}})"),
            "/channels/18446744073709551616");
  for (const char* key : {"", "-1", "01", "1e0", " 1", "0x1", "color"}) {
    const json patch{{"channels", {{key, json::object()}}}};
    EXPECT_EQ(refusedAt("{}", patch.dump().c_str()), "/channels/" + std::string(key));
  }
  EXPECT_EQ(refusedAt("{}", R"({"channels": [{}, {}, {}, {}, {}]})"), "/channels/4");
}

TEST(ApplyPatch, MergesAnObjectThatMayBeAbsent) {
  const auto edited = [](const char* channel, const char* patch) {
    const json scene{{"channels", {json::parse(channel)}}};
    return applyPatch(scene, {{"channels", {{"0", {{"gradientOpacity", json::parse(patch)}}}}}},
                      kChannels)["channels"][0]["gradientOpacity"];
  };
  const char* set = R"({"gradientOpacity": {"range": [1, 2], "points": [[0, 1]]}})";
  EXPECT_EQ(edited("{}", "{}"), json::object());
  EXPECT_EQ(edited("{}", R"({"range": [1, 2]})"), json::parse(R"({"range": [1, 2]})"));
  EXPECT_EQ(edited(set, R"({"range": [3, 4]})"), json::parse(R"({"range": [3, 4], "points": [[0, 1]]})"));
  EXPECT_EQ(edited(set, R"({"range": null})"), json::parse(R"({"points": [[0, 1]]})"));
  EXPECT_EQ(edited(set, R"({"points": {"0": [0.5, 0.25]}})"),
            json::parse(R"({"range": [1, 2], "points": [[0.5, 0.25]]})"));
  EXPECT_EQ(applied(R"({"channels": [{"gamma": 2, "gradientOpacity": {"range": [1, 2]}}]})",
                    R"({"channels": {"0": {"gradientOpacity": null}}})"),
            json::parse(R"({"channels": [{"gamma": 2}]})"));
  const char* path = R"({"channels": {"0": {"gradientOpacity": )";
  EXPECT_EQ(refusedAt("{}", (path + std::string("5}}}")).c_str()), "/channels/0/gradientOpacity");
  EXPECT_EQ(refusedAt("{}", (path + std::string(R"({"lo": null}}}})")).c_str()),
            "/channels/0/gradientOpacity/lo");
}

TEST(ApplyPatch, NamesUnknownFieldsEvenWhenTheyAreNull) {
  EXPECT_EQ(refusedAt("{}", R"({"fog": null})"), "/fog");
  EXPECT_EQ(refusedAt("{}", R"({"channels": {"0": {"colour": "#ffffff"}}})"), "/channels/0/colour");
  EXPECT_EQ(refusedAt("{}", R"({"channels": [{"colour": 1}]})"), "/channels/0/colour");
}

TEST(ApplyPatch, RefusesWhatCannotBePatched) {
  for (const char* patch : {"null", "[]", "5", "\"x\""})
    EXPECT_EQ(refusedAt(R"({"dataset": "a"})", patch), "");
  EXPECT_EQ(refusedAt("{}", R"({"camera": 5})"), "/camera");
  EXPECT_EQ(refusedAt("{}", R"({"channels": "all"})"), "/channels");
  EXPECT_EQ(refusedAt("{}", R"({"channels": [5]})"), "/channels/0");
  EXPECT_EQ(refusedAt("{}", R"({"dataset": {"a": 1}})"), "/dataset");
}

TEST(ApplyPatch, LetsTheFieldThatIsSetRemoveItsPartner) {
  EXPECT_EQ(applied(R"({"camera": {"fovY": 20}})", R"({"camera": {"orthoHeight": 5}})"),
            json::parse(R"({"camera": {"orthoHeight": 5}})"));
  EXPECT_EQ(applied(R"({"camera": {"orthoHeight": 5}})", R"({"camera": {"fovY": 20}})"),
            json::parse(R"({"camera": {"fovY": 20}})"));
  EXPECT_EQ(
      applied(R"({"channels": [{"color": "#ffffff"}]})", R"({"channels": {"0": {"colormap": "fire"}}})"),
      json::parse(R"({"channels": [{"colormap": "fire"}]})"));
  EXPECT_EQ(
      applied(R"({"channels": [{"colormap": "fire"}]})", R"({"channels": {"0": {"color": "#ffffff"}}})"),
      json::parse(R"({"channels": [{"color": "#ffffff"}]})"));
}

TEST(ApplyPatch, LeavesAPartnerThatIsNamedOrNotReplaced) {
  EXPECT_EQ(applied(R"({"camera": {"orthoHeight": 5}})", R"({"camera": {"fovY": 20, "orthoHeight": 6}})"),
            json::parse(R"({"camera": {"fovY": 20, "orthoHeight": 6}})"));
  EXPECT_EQ(applied(R"({"camera": {"orthoHeight": 5}})", R"({"camera": {"fovY": null}})"),
            json::parse(R"({"camera": {"orthoHeight": 5}})"));
}

json resolvedBetween(const char* from, const char* to) {
  const auto scene = [](const char* text) { return parseScene(json::parse(text), server::rendererLists()); };
  return patchBetween(scene(from), scene(to));
}

TEST(PatchBetween, SaysNothingOfWhatIsEqual) {
  const char* scene = R"({"camera": {"fovY": 20}, "channels": [{"gamma": 2}, {}]})";
  EXPECT_EQ(resolvedBetween(scene, scene), json::object());
}

TEST(PatchBetween, NamesTheEditedChannelAlone) {
  EXPECT_EQ(resolvedBetween(R"({"channels": [{"gamma": 2}, {"gamma": 3}]})",
                            R"({"channels": [{"gamma": 2}, {"gamma": 4}]})"),
            json::parse(R"({"channels": {"1": {"gamma": 4}}})"));
}

TEST(PatchBetween, NamesTheEditedMemberOfAnObjectThatMayBeAbsent) {
  const char *off = R"({"channels": [{}]})",
             *on = R"({"channels": [{"gradientOpacity": {"range": [1, 2], "points": [[0, 1]]}}]})";
  EXPECT_EQ(resolvedBetween(off, on)["channels"]["0"],
            json::parse(R"({"gradientOpacity": {"range": [1, 2], "points": [[0, 1]]}})"));
  EXPECT_EQ(resolvedBetween(on, off)["channels"]["0"], json::parse(R"({"gradientOpacity": null})"));
  EXPECT_EQ(
      resolvedBetween(on, R"({"channels": [{"gradientOpacity": {"range": [1, 3], "points": [[0, 1]]}}]})"),
      json::parse(R"({"channels": {"0": {"gradientOpacity": {"range": [1, 3]}}}})"));
}

/// Sparse scenes in which every field is sometimes present. Lists are small and there are few different
/// values, so that equal parts are common.
class RandomScenes {
 public:
  explicit RandomScenes(unsigned seed) : random_(seed) {}

  json scene() {
    json out = json::object();
    if (chance()) out["dataset"] = pick({"a", "b"});
    if (chance()) {
      out["channels"] = json::array();
      for (std::size_t i = random_() % (kChannels + 1); i > 0; --i) out["channels"].push_back(channel());
    }
    if (chance()) out["blend"] = chance() ? json{{"mode", "density"}} : json::object();
    if (chance()) out["camera"] = camera();
    if (chance()) out["integrator"] = {{"seed", random_() % 3}};
    if (chance()) out["image"] = {{"width", 1 + random_() % 2}, {"filter", pick({"box", "point"})}};
    if (chance()) out["stop"] = chance() ? json{{"samples", 1 + random_() % 2}} : json::object();
    return out;
  }

  /// A patch in all forms of the protocol: nulls, whole lists, entries by index.
  json patch() {
    json out = scene();
    for (const char* name : {"dataset", "channels", "camera", "image"}) {
      if (random_() % 5 == 0) out[name] = nullptr;
    }
    if (out.contains("camera") && out["camera"].is_object() && chance()) out["camera"]["fovY"] = nullptr;
    if (chance()) {
      out["channels"] = json::object();
      for (std::size_t i = 0; i < kChannels; ++i) {
        if (!chance()) continue;
        json& entry = out["channels"][std::to_string(i)] = chance() ? channel() : json();
        if (entry.is_object() && chance()) entry["gamma"] = nullptr;
        if (entry.is_object() && random_() % 4 == 0) entry["gradientOpacity"] = nullptr;
        if (entry.contains("gradientOpacity") && entry["gradientOpacity"].is_object() && chance())
          entry["gradientOpacity"]["range"] = nullptr;
      }
    }
    return out;
  }

 private:
  bool chance() { return random_() % 2 == 0; }
  json pick(std::initializer_list<const char*> values) {
    return *(values.begin() + random_() % values.size());
  }
  json channel() {
    json out = json::object();
    if (chance()) out["gamma"] = 1 + random_() % 2;
    if (chance()) out["visible"] = chance();
    if (chance()) out["range"] = {0, random_() % 2};
    if (chance()) out["opacity"] = chance() ? json::parse("[[0, 0], [1, 1]]") : json::parse("[[0, 1]]");
    if (chance()) out[chance() ? "color" : "colormap"] = "#ffffff";
    if (out.contains("colormap")) out["colormap"] = pick({"gray", "fire"});
    if (chance()) {
      json& steep = out["gradientOpacity"] = json::object();
      if (chance()) steep["range"] = {0, random_() % 2};
      if (chance()) steep["points"] = json::parse("[[0, 1]]");
    }
    return out;
  }
  json camera() {
    json out = json::object();
    if (chance()) out["fovY"] = 20 + random_() % 2;
    if (chance()) out["orthoHeight"] = 1 + random_() % 2;
    if (chance()) out["eye"] = {0, 0, random_() % 2};
    return out;
  }
  std::mt19937 random_;
};

constexpr int kRounds = 3000;

TEST(PatchBetween, TurnsAnySceneIntoAnyOther) {
  RandomScenes random(1);
  for (int round = 0; round < kRounds; ++round) {
    const Scene from = parseScene(random.scene(), server::rendererLists());
    const Scene to = parseScene(random.scene(), server::rendererLists());
    const json patch = patchBetween(from, to);
    ASSERT_EQ(applyPatch(toJson(from), patch, kChannels), toJson(to)) << toJson(from) << '\n'
                                                                      << toJson(to) << '\n'
                                                                      << patch;
  }
}

TEST(ApplyPatch, GivesTheSameSceneWhenAppliedTwice) {
  RandomScenes random(3);
  for (int round = 0; round < kRounds; ++round) {
    const json scene = random.scene(), patch = random.patch();
    const json once = applyPatch(scene, patch, kChannels);
    ASSERT_EQ(applyPatch(once, patch, kChannels), once) << scene << '\n' << patch;
  }
}

TEST(ApplyPatch, NeverLeavesANullBehind) {
  RandomScenes random(4);
  for (int round = 0; round < kRounds; ++round) {
    const json scene = applyPatch(random.scene(), random.patch(), kChannels);
    ASSERT_EQ(scene.dump().find("null"), std::string::npos) << scene;
    ASSERT_EQ(applyPatch(json::object(), scene, kChannels), scene) << "a whole scene is a patch of {}";
  }
}

}  // namespace
}  // namespace scolopax::protocol
