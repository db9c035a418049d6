// SPDX-License-Identifier: Apache-2.0
// Reading scenes: defaults, every rule of "Exact meaning", and the field that each error names.
#include "protocol/scene_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "server/scene_resolver.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

Scene parsed(const json& document) { return parseScene(document, server::rendererLists()); }

/// The pointer of the error that reading throws; "none" if it throws none.
std::string refusedAt(const json& document) {
  try {
    parsed(document);
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_NE(std::string(error.what()).find(error.pointer), std::string::npos)
        << "the detail names the field";
    return error.pointer;
  }
  return "none";
}

json channel(const json& fields) { return {{"channels", json::array({fields})}}; }
std::string channelRefusedAt(const json& fields) { return refusedAt(channel(fields)); }

TEST(ParseScene, TakesTheEmptyObjectAndGivesTheDefaultsOfTheDesign) {
  const Scene scene = parsed(json::object());
  EXPECT_FALSE(scene.dataset);
  EXPECT_TRUE(scene.channels.empty());
  EXPECT_EQ(scene.blend.mode, "density");
  EXPECT_FALSE(scene.camera.eye || scene.camera.target || scene.camera.up || scene.camera.orthoHeight);
  EXPECT_EQ(scene.camera.fovY, 35);
  EXPECT_EQ(scene.integrator.method, "auto");
  EXPECT_EQ(scene.integrator.macrocell, 4U);
  EXPECT_EQ(scene.integrator.sampling, "low-discrepancy");
  EXPECT_EQ(scene.integrator.seed, 0U);
  EXPECT_EQ(scene.image.width, 512U);
  EXPECT_EQ(scene.image.height, 512U);
  EXPECT_EQ(scene.image.background, "#000000");
  EXPECT_EQ(scene.image.filter, "box");
  EXPECT_FALSE(scene.stop.samples || scene.stop.seconds || scene.stop.error);
}

TEST(ParseScene, GivesAnEmptyChannelTheDefaultsOfTheDesign) {
  const Channel look = parsed(channel(json::object())).channels.at(0);
  EXPECT_TRUE(look.visible);
  EXPECT_EQ(look.gamma, 1);
  EXPECT_EQ(look.interpolation, "trilinear");
  EXPECT_FALSE(look.name || look.range || look.color || look.colormap || look.density);
  ASSERT_EQ(look.opacity.size(), 2U);
  EXPECT_EQ(look.opacity[0].position, 0);
  EXPECT_EQ(look.opacity[0].value, 0);
  EXPECT_EQ(look.opacity[1].position, 1);
  EXPECT_EQ(look.opacity[1].value, 1);
}

TEST(ParseScene, ReadsEveryField) {
  const json document = json::parse(R"({
    "dataset": "mri", "time": 7,
    "channels": [{"name": "T1", "visible": false, "range": [10, -2.5], "color": "#Ff8000",
                  "opacity": [[0, 0], [0.5, 0], [0.5, 1]], "gamma": 2, "density": 0, "weight": 0.5,
                  "gradientOpacity": {"range": [3, 0.5], "points": [[0.25, 1], [0.75, 0]]},
                  "isovalues": [{"value": -2, "opacity": 0.5, "color": "#00ff80"}], "peaks": "only",
                  "interpolation": "nearest",
                  "material": {"ambient": 0, "diffuse": 1, "specular": 0.5, "shininess": 8}},
                 {"colormap": "fire"}, {"colormap": [[0, "#000000"], [1, "#ffffff"]]}],
    "clip": [{"point": [1, 2, 3], "normal": [0, 1, 0], "media": [2, 0]}],
    "crop": {"x": [1, 2.5], "y": [-3, 4], "z": [5, 5], "regions": [
      true, false, false, false, false, false, false, false, false, false, false, false, false, false, false,
      false, false, false, false, false, false, false, false, false, false, false, true]},
    "blend": {"mode": "mix"}, "shading": true, "shadows": true,
    "lights": [{"type": "point", "position": [1, 2, 3], "direction": [0, 0, 1], "color": "#ff0000", "intensity": 2}],
    "camera": {"eye": [1, 2, 3], "target": [4, 5, 6], "up": [0, 0, 1], "fovY": 90, "orthoHeight": 7},
    "integrator": {"method": "sync-dda", "macrocell": 8, "step": 0.25, "sampling": "independent",
                   "seed": 4294967295},
    "image": {"width": 1, "height": 16384, "background": "#102030", "filter": "point"},
    "stop": {"samples": 16777216, "seconds": 1.5, "error": 0.01}})");
  const Scene scene = parsed(document);
  EXPECT_EQ(scene.dataset, "mri");
  ASSERT_EQ(scene.channels.size(), 3U);
  EXPECT_EQ(scene.channels[0].name, "T1");
  EXPECT_FALSE(scene.channels[0].visible);
  EXPECT_EQ(scene.channels[0].range, (std::array<double, 2>{10, -2.5}));
  EXPECT_EQ(scene.channels[0].color, "#Ff8000");
  EXPECT_EQ(scene.channels[0].opacity.at(2).value, 1);
  EXPECT_EQ(scene.channels[0].gradientOpacity.value().range, (std::array<double, 2>{3, 0.5}));
  EXPECT_EQ(scene.channels[0].gradientOpacity->points.at(1).position, 0.75);
  EXPECT_EQ(scene.channels[0].gradientOpacity->points.at(0).value, 1);
  EXPECT_EQ(scene.channels[0].isovalues.at(0).value, -2);
  EXPECT_EQ(scene.channels[0].isovalues[0].opacity, 0.5);
  EXPECT_EQ(scene.channels[0].isovalues[0].color, "#00ff80");
  EXPECT_EQ(scene.channels[0].peaks, "only");
  EXPECT_EQ(scene.channels[0].interpolation, "nearest");
  EXPECT_EQ(scene.channels[0].gamma, 2);
  EXPECT_EQ(scene.channels[0].density, 0.0);
  EXPECT_EQ(std::get<std::string>(*scene.channels[1].colormap), "fire");
  EXPECT_EQ(std::get<std::vector<ColorPoint>>(*scene.channels[2].colormap).at(1).color, "#ffffff");
  EXPECT_EQ(scene.camera.eye, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(scene.camera.orthoHeight, 7.0);
  EXPECT_EQ(scene.clip.at(0).media, (std::vector<std::uint32_t>{2, 0}));
  EXPECT_EQ(scene.crop.x, (std::array<double, 2>{1, 2.5}));
  EXPECT_TRUE(scene.crop.regions[0] && scene.crop.regions[26] && !scene.crop.regions[13]);
  EXPECT_EQ(scene.integrator.method, "sync-dda");
  EXPECT_EQ(scene.integrator.sampling, "independent");
  EXPECT_EQ(scene.integrator.seed, 4294967295U);
  EXPECT_EQ(scene.image.height, 16384U);
  EXPECT_EQ(scene.image.filter, "point");
  EXPECT_EQ(scene.stop.samples, 16777216U);
  EXPECT_EQ(scene.stop.error, 0.01);
  // The members that were set come back unchanged; the others have their defaults.
  json expected = document;
  expected["channels"][1].update(
      {{"visible", true},
       {"opacity", {{0, 0}, {1, 1}}},
       {"isovalues", json::array()},
       {"peaks", "off"},
       {"interpolation", "trilinear"},
       {"gamma", 1},
       {"weight", 1},
       {"material", {{"ambient", 0.3}, {"diffuse", 0.7}, {"specular", 0.2}, {"shininess", 20}}}});
  expected["channels"][2].update(expected["channels"][1], false);
  expected["channels"][2]["colormap"] = document["channels"][2]["colormap"];
  EXPECT_EQ(toJson(scene), expected);
}

TEST(ParseScene, TakesNullForWhatIsAutomaticAndForNothingElse) {
  EXPECT_FALSE(parsed({{"dataset", nullptr}}).dataset);
  EXPECT_FALSE(parsed(channel({{"density", nullptr}})).channels[0].density);
  EXPECT_FALSE(parsed(channel({{"color", "#ffffff"}, {"colormap", nullptr}})).channels[0].colormap);
  EXPECT_EQ(channelRefusedAt({{"gamma", nullptr}}), "/channels/0/gamma");
  EXPECT_EQ(refusedAt({{"camera", nullptr}}), "/camera");
  EXPECT_EQ(refusedAt({{"channels", json::array({nullptr})}}), "/channels/0");
}

TEST(ParseScene, TakesOpacityByTheGradientThatIsAbsentNullOrHasNoMembers) {
  EXPECT_FALSE(parsed(channel(json::object())).channels[0].gradientOpacity);
  EXPECT_FALSE(parsed(channel({{"gradientOpacity", nullptr}})).channels[0].gradientOpacity);
  const Scene scene = parsed(channel({{"gradientOpacity", json::object()}}));
  ASSERT_TRUE(scene.channels[0].gradientOpacity);
  EXPECT_FALSE(scene.channels[0].gradientOpacity->range);
  EXPECT_EQ(toJson(scene)["channels"][0]["gradientOpacity"], (json{{"points", {{0, 0}, {1, 1}}}}));
  EXPECT_FALSE(
      parsed(channel({{"gradientOpacity", {{"range", nullptr}}}})).channels[0].gradientOpacity->range);
}

TEST(ParseScene, NamesWhatIsWrongWithOpacityByTheGradient) {
  const std::string at = "/channels/0/gradientOpacity";
  const auto refused = [](const json& value) { return channelRefusedAt({{"gradientOpacity", value}}); };
  EXPECT_EQ(refused(true), at);
  EXPECT_EQ(refused(json::array({json::array({0, 1})})), at);
  EXPECT_EQ(refused({{"curve", json::array()}}), at + "/curve");
  EXPECT_EQ(refused({{"range", 1}}), at + "/range");
  EXPECT_EQ(refused({{"range", {0}}}), at + "/range");
  EXPECT_EQ(refused({{"range", {0, std::numeric_limits<double>::infinity()}}}), at + "/range/1");
  EXPECT_EQ(refused({{"range", {5, 5}}}), "none");
  EXPECT_EQ(refused({{"points", nullptr}}), at + "/points");
  EXPECT_EQ(refused({{"points", json::array()}}), at + "/points");
  EXPECT_EQ(refused({{"points", json::parse("[[0.5, 0], [0.4, 1]]")}}), at + "/points/1/0");
  EXPECT_EQ(refused({{"points", json::parse("[[0, 1.5]]")}}), at + "/points/0/1");
  EXPECT_EQ(refused({{"points", json::array_t(4096, {0, 0})}}), "none");
  EXPECT_EQ(refused({{"points", json::array_t(4097, {0, 0})}}), at + "/points");
}

TEST(ParseScene, NamesWhatIsWrongWithClipping) {
  const auto clip = [](const json& plane) { return json{{"clip", {plane}}}; };
  EXPECT_EQ(refusedAt(clip({{"point", {1, 2}}})), "/clip/0/point");
  EXPECT_EQ(refusedAt(clip({{"normal", nullptr}})), "/clip/0/normal");
  EXPECT_EQ(refusedAt(clip({{"media", 1}})), "/clip/0/media");
  EXPECT_EQ(refusedAt(clip({{"media", {0, 0.5}}})), "/clip/0/media/1");
  EXPECT_EQ(refusedAt(clip({{"media", {32}}})), "/clip/0/media/0");
  EXPECT_EQ(refusedAt({{"clip", json::array({{}, {}, {}, {}, {}, {}, {}, {}, {}})}}), "/clip");
  EXPECT_EQ(refusedAt({{"crop", {{"x", {1}}}}}), "/crop/x");
  EXPECT_EQ(refusedAt({{"crop", {{"regions", {true}}}}}), "/crop/regions");
  json regions = std::vector<bool>(27);
  regions[3] = 1;
  EXPECT_EQ(refusedAt({{"crop", {{"regions", regions}}}}), "/crop/regions/3");
}

TEST(ParseScene, NamesUnknownFields) {
  EXPECT_EQ(refusedAt({{"fog", json::array()}}), "/fog");
  EXPECT_EQ(channelRefusedAt({{"colour", "#ffffff"}}), "/channels/0/colour");
  EXPECT_EQ(refusedAt({{"camera", {{"a/b~c", 1}}}}), "/camera/a~1b~0c") << "RFC 6901 escapes";
  EXPECT_EQ(refusedAt({{"", 1}}), "/");
}

TEST(ParseScene, NamesFieldsOfTheWrongType) {
  EXPECT_EQ(refusedAt(json::array()), "");
  EXPECT_EQ(refusedAt(5), "");
  EXPECT_EQ(refusedAt({{"channels", json::object()}}), "/channels");
  EXPECT_EQ(refusedAt({{"dataset", 3}}), "/dataset");
  EXPECT_EQ(channelRefusedAt({{"visible", 1}}), "/channels/0/visible");
  EXPECT_EQ(channelRefusedAt({{"gamma", true}}), "/channels/0/gamma");
  EXPECT_EQ(channelRefusedAt({{"gamma", "1"}}), "/channels/0/gamma");
  EXPECT_EQ(refusedAt({{"camera", {{"eye", {1, 2}}}}}), "/camera/eye");
  EXPECT_EQ(refusedAt({{"camera", {{"eye", {1, 2, "3"}}}}}), "/camera/eye/2");
}

TEST(ParseScene, HoldsNumbersToTheirBounds) {
  const auto gammaAt = [](double gamma) { return channelRefusedAt({{"gamma", gamma}}); };
  EXPECT_EQ(gammaAt(0), "/channels/0/gamma");
  EXPECT_EQ(gammaAt(1e-300), "none");
  EXPECT_EQ(gammaAt(100), "none");
  EXPECT_EQ(gammaAt(100.001), "/channels/0/gamma");
  EXPECT_EQ(channelRefusedAt({{"density", -1e-9}}), "/channels/0/density");
  EXPECT_EQ(channelRefusedAt({{"density", 1e30}}), "none");
  EXPECT_EQ(channelRefusedAt({{"density", 1.1e30}}), "/channels/0/density");
  EXPECT_EQ(refusedAt({{"camera", {{"fovY", 0}}}}), "/camera/fovY");
  EXPECT_EQ(refusedAt({{"camera", {{"fovY", 179.9}}}}), "none");
  EXPECT_EQ(refusedAt({{"camera", {{"fovY", 180}}}}), "/camera/fovY");
  EXPECT_EQ(refusedAt({{"camera", {{"orthoHeight", 0}}}}), "/camera/orthoHeight");
  EXPECT_EQ(refusedAt({{"integrator", {{"macrocell", 0}}}}), "/integrator/macrocell");
  EXPECT_EQ(refusedAt({{"integrator", {{"macrocell", 65}}}}), "/integrator/macrocell");
  EXPECT_EQ(refusedAt({{"integrator", {{"seed", -1}}}}), "/integrator/seed");
  EXPECT_EQ(refusedAt({{"integrator", {{"seed", 4294967296}}}}), "/integrator/seed");
  EXPECT_EQ(refusedAt({{"image", {{"width", 0}}}}), "/image/width");
  EXPECT_EQ(refusedAt({{"image", {{"height", 16385}}}}), "/image/height");
  EXPECT_EQ(refusedAt({{"image", {{"width", 1.5}}}}), "/image/width");
  EXPECT_EQ(refusedAt({{"image", {{"width", 640.0}}}}), "none") << "an integer in JSON Schema's sense";
  EXPECT_EQ(refusedAt({{"stop", {{"samples", 0}}}}), "/stop/samples");
  EXPECT_EQ(refusedAt({{"stop", {{"samples", 16777217}}}}), "/stop/samples");
  EXPECT_EQ(refusedAt({{"stop", {{"seconds", 0}}}}), "/stop/seconds");
  EXPECT_EQ(refusedAt({{"stop", {{"error", -0.1}}}}), "/stop/error");
}

TEST(ParseScene, RefusesNumbersThatAreNotFinite) {
  for (const double value :
       {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(channelRefusedAt({{"range", {0, value}}}), "/channels/0/range/1");
    EXPECT_EQ(channelRefusedAt({{"gamma", value}}), "/channels/0/gamma");
    EXPECT_EQ(refusedAt({{"image", {{"width", value}}}}), "/image/width");
  }
}

TEST(ParseScene, TakesReversedAndEmptyRanges) {
  EXPECT_EQ(channelRefusedAt({{"range", {5, -5}}}), "none");
  EXPECT_EQ(channelRefusedAt({{"range", {5, 5}}}), "none");
  EXPECT_EQ(channelRefusedAt({{"range", {5}}}), "/channels/0/range");
}

TEST(ParseScene, HoldsControlPointsToTheirRules) {
  const auto opacityAt = [](const json& points) { return channelRefusedAt({{"opacity", points}}); };
  const std::string at = "/channels/0/opacity";
  EXPECT_EQ(opacityAt(json::array()), at);
  EXPECT_EQ(opacityAt(json::parse("[[0.5, 1]]")), "none");
  EXPECT_EQ(opacityAt(json::parse("[[0, 0], [0.5, 0], [0.5, 1]]")), "none")
      << "two equal positions are a jump";
  EXPECT_EQ(opacityAt(json::parse("[[0.5, 0], [0.4, 1]]")), at + "/1/0");
  EXPECT_EQ(opacityAt(json::parse("[[-0.1, 0]]")), at + "/0/0");
  EXPECT_EQ(opacityAt(json::parse("[[0, 1.1]]")), at + "/0/1");
  EXPECT_EQ(opacityAt(json::parse("[[0, null]]")), at + "/0/1");
  EXPECT_EQ(opacityAt(json::parse("[[0, 0, 0]]")), at + "/0");
  EXPECT_EQ(opacityAt(json::parse("[0, 1]")), at + "/0");
  EXPECT_EQ(opacityAt("ramp"), at);
  EXPECT_EQ(opacityAt(json::array_t(4096, {0, 0})), "none");
  EXPECT_EQ(opacityAt(json::array_t(4097, {0, 0})), at);
}

TEST(ParseScene, HoldsColoursToTheirForm) {
  for (const char* bad : {"", "#fff", "ffffff", "#gggggg", "#ffffff ", "red"}) {
    EXPECT_EQ(channelRefusedAt({{"color", bad}}), "/channels/0/color") << bad;
  }
  EXPECT_EQ(refusedAt({{"image", {{"background", "#12345"}}}}), "/image/background");
  EXPECT_EQ(channelRefusedAt({{"colormap", json::parse(R"([[0, "#fff"]])")}}), "/channels/0/colormap/0/1");
  EXPECT_EQ(channelRefusedAt({{"colormap", json::array()}}), "/channels/0/colormap");
  EXPECT_EQ(channelRefusedAt({{"color", "#ffffff"}, {"colormap", "fire"}}), "/channels/0/colormap");
}

TEST(ParseScene, TakesOnlyTheNamesOfTheLists) {
  EXPECT_EQ(refusedAt({{"blend", {{"mode", "maximum"}}}}), "/blend/mode");
  EXPECT_EQ(refusedAt({{"integrator", {{"method", ""}}}}), "/integrator/method");
  EXPECT_EQ(refusedAt({{"image", {{"filter", "gauss"}}}}), "/image/filter");
  EXPECT_EQ(channelRefusedAt({{"colormap", "jet"}}), "/channels/0/colormap");
  EXPECT_EQ(channelRefusedAt({{"interpolation", "linear"}}), "/channels/0/interpolation");
  for (const EnumEntry& entry : server::rendererLists().colormaps) {
    EXPECT_EQ(channelRefusedAt({{"colormap", entry.name}}), "none") << entry.name;
  }
}

TEST(ParseScene, LimitsListsAndTexts) {
  EXPECT_EQ(refusedAt({{"channels", json::array_t(32, json::object())}}), "none");
  EXPECT_EQ(refusedAt({{"channels", json::array_t(33, json::object())}}), "/channels");
  EXPECT_EQ(refusedAt({{"dataset", std::string(256, 'a')}}), "none");
  EXPECT_EQ(refusedAt({{"dataset", std::string(257, 'a')}}), "/dataset");
}

TEST(ParseScene, SaysWhatWasExpectedAndFound) {
  try {
    parsed(channel({{"gamma", -1}}));
    FAIL() << "not refused";
  } catch (const ProtocolError& error) {
    EXPECT_STREQ(error.what(), "/channels/0/gamma: expected a number > 0 and <= 100, found -1");
  }
}

TEST(ToJson, GivesADocumentThatReadsAsTheSameScene) {
  const json once =
      toJson(parsed(json::parse(R"({"channels": [{"gradientOpacity": {}}, {"colormap": "gray"}]})")));
  EXPECT_EQ(toJson(parsed(once)), once);
}

TEST(CheckChannelCount, NamesTheFirstSurplusChannel) {
  Scene scene;
  scene.channels.resize(3);
  EXPECT_NO_THROW(checkChannelCount(scene, 3));
  try {
    checkChannelCount(scene, 2);
    FAIL() << "not refused";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_EQ(error.pointer, "/channels/2");
  }
}

}  // namespace
}  // namespace scolopax::protocol
