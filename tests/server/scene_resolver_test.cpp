// SPDX-License-Identifier: Apache-2.0
#include "server/scene_resolver.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "protocol/patch.h"
#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using protocol::ProtocolError;
using protocol::toJson;

SceneResolver resolver() { return {testing::smallStore(), {1'000'000}}; }

/// Status and pointer of the error that resolving a scene throws.
std::pair<int, std::string> errorOf(const json& scene) {
  try {
    resolver().replace(scene);
  } catch (const ProtocolError& error) {
    return {error.status, error.pointer};
  }
  return {0, ""};
}

TEST(SceneResolver, FillsEveryValueOfAnEmptyScene) {
  const auto scene = resolver().replace(json::object());
  EXPECT_EQ(scene->sparse.whole(), json::object());
  EXPECT_EQ(toJson(scene->resolved)["dataset"], "small");
  ASSERT_EQ(toJson(scene->resolved)["channels"].size(), 2u);
  const json channels = toJson(scene->resolved)["channels"];
  for (const json& channel : channels) {
    EXPECT_TRUE(channel.contains("name"));
    EXPECT_EQ(channel["range"].size(), 2u);
    EXPECT_GT(channel["density"], 0.0);
    EXPECT_TRUE(channel.contains("color"));
  }
  EXPECT_EQ(toJson(scene->resolved)["channels"][1]["name"], "green");
  EXPECT_NE(toJson(scene->resolved)["channels"][0]["color"], toJson(scene->resolved)["channels"][1]["color"]);
  EXPECT_EQ(toJson(scene->resolved)["camera"]["eye"].size(), 3u);
  EXPECT_EQ(toJson(scene->resolved)["integrator"]["method"], "auto");
  EXPECT_EQ(scene->render.method, Method::automatic);
  EXPECT_EQ(toJson(scene->resolved)["stop"], (json{{"samples", 64}}));
  EXPECT_EQ(scene->stop.samples, 64u);
}

TEST(SceneResolver, TakesItsCallersSampleCountWithoutAStopRuleAndKeepsItInPatches) {
  const SceneResolver one = resolver();
  const auto scene = one.replace(json::object(), {}, 100);
  EXPECT_EQ(scene->stop.samples, 100u);
  const auto timed = one.patch(*scene, {{"stop", {{"seconds", 3}}}});
  EXPECT_EQ(timed->stop.samples, 0u);
  EXPECT_EQ(one.patch(*timed, {{"stop", nullptr}})->stop.samples, 100u);
  EXPECT_EQ(one.replace(json::object())->stop.samples, kRenderSamples);
}

TEST(SceneResolver, LeavesStopRulesOutOfWhatDecidesThePicture) {
  const auto resolve = resolver();
  const auto plain = resolve.replace(json::object());
  const auto fine = resolve.replace({{"stop", {{"error", 1e-4}}}});
  EXPECT_EQ(fine->stop.error, 1e-4);
  EXPECT_TRUE(makeSameFilm(*fine, *plain));
}

TEST(SceneResolver, ResolvesAResolvedSceneToItself) {
  const auto first = resolver().replace({{"channels", {{{"gamma", 2}}}}, {"camera", {{"orthoHeight", 3}}}});
  const auto second = resolver().replace(toJson(first->resolved));
  EXPECT_EQ(second->resolved, first->resolved);
}

TEST(SceneResolver, HandsTheRendererWhatTheSceneSays) {
  const json document = json::parse(R"({
    "channels": [
      {"range": [3, 7], "gamma": 2, "density": 5, "color": "#ff0080", "opacity": [[0, 0], [0.5, 1], [1, 0.25]]},
      {"visible": false, "colormap": [[0, "#000000"], [1, "#ffffff"]], "interpolation": "cubic"}],
    "camera": {"eye": [1, 2, 30], "target": [0, 1, 0], "up": [0, 1, 0], "orthoHeight": 4},
    "integrator": {"method": "sync-dda", "macrocell": 8, "seed": 9},
    "image": {"width": 40, "height": 30, "background": "#ffffff", "filter": "point"},
    "stop": {"seconds": 2.5}})");
  const auto scene = resolver().replace(document);
  const Scene& render = scene->render;
  ASSERT_EQ(render.channels.size(), 2u);
  const ChannelAppearance& first = render.channels[0];
  EXPECT_EQ(first.rangeLo, 3);
  EXPECT_EQ(first.rangeHi, 7);
  EXPECT_EQ(first.interpolation, Interpolation::trilinear);
  EXPECT_EQ(first.gamma, 2);
  EXPECT_EQ(first.density, 5);
  ASSERT_EQ(first.opacity.size(), 3u);
  EXPECT_EQ(first.opacity[1].position, 0.5);
  EXPECT_EQ(first.opacity[2].value, 0.25);
  ASSERT_EQ(first.color.size(), 1u);
  EXPECT_FLOAT_EQ(float(first.color[0].color.r), 1);
  EXPECT_EQ(first.color[0].color.g, 0);
  EXPECT_NEAR(first.color[0].color.b, 0.215861, 1e-5);  // IEC 61966-2-1 of 128/255
  EXPECT_FALSE(render.channels[1].visible);
  EXPECT_EQ(render.channels[1].color.size(), 2u);
  EXPECT_EQ(render.channels[1].interpolation, Interpolation::cubic);
  EXPECT_EQ(render.camera.eye, glm::dvec3(1, 2, 30));
  EXPECT_EQ(render.camera.orthoHeight, 4);
  EXPECT_EQ(render.method, Method::syncDda);
  EXPECT_EQ(render.macrocell, 8);
  EXPECT_EQ(render.seed, 9u);
  EXPECT_EQ(render.width, 40);
  EXPECT_EQ(render.height, 30);
  EXPECT_EQ(render.background, glm::vec3(1));
  EXPECT_EQ(render.filter, PixelFilter::point);
  EXPECT_EQ(scene->stop.samples, 0u);
  EXPECT_EQ(scene->stop.seconds, 2.5);
}

TEST(SceneResolver, TakesTheNamesOfTheRenderersLists) {
  const auto lists = rendererLists();
  ASSERT_EQ(lists.methods.size(), std::size(kMethods));
  EXPECT_EQ(lists.methods[0].name, "auto");
  EXPECT_EQ(lists.blendModes.size(), std::size(kBlendModes));
  for (const auto& colormap : lists.colormaps)
    EXPECT_GT(
        resolver().replace({{"channels", {{{"colormap", colormap.name}}}}})->render.channels[0].color.size(),
        1u)
        << colormap.name;
}

TEST(SceneResolver, NamesTheFieldThatIsWrong) {
  using Expected = std::pair<int, std::string>;
  EXPECT_EQ(errorOf({{"dataset", "unknown"}}), Expected(422, "/dataset"));
  EXPECT_EQ(errorOf({{"dataset", 7}}), Expected(422, "/dataset"));
  EXPECT_EQ(errorOf({{"channels", {json::object(), json::object(), json::object()}}}).first, 422);
  EXPECT_EQ(errorOf({{"image", {{"width", 2000}, {"height", 2000}}}}), Expected(422, "/image"));
  EXPECT_EQ(errorOf({{"camera", {{"eye", {1, 1, 1}}, {"target", {1, 1, 1}}}}}), Expected(422, "/camera"));
  EXPECT_EQ(errorOf(json::array()).first, 422);
  EXPECT_EQ(errorOf(nullptr).first, 422);
}

TEST(SceneResolver, BoundsTheNumberOfMacrocellsButTakesTheDefaultSizeAlways) {
  // Two channels of 3 x 2 x 1, 2 x 1 x 1 and 1 cells.
  const auto bounded = [](std::size_t most, int size) {
    const SceneResolver resolver(testing::smallStore(), {1'000'000, most});
    try {
      resolver.replace({{"integrator", {{"macrocell", size}}}});
    } catch (const ProtocolError& error) {
      EXPECT_EQ(error.pointer, "/integrator/macrocell");
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(bounded(12, 1), "");
  EXPECT_EQ(bounded(11, 1), "expected at least 2 for this data set, found 1");
  EXPECT_EQ(bounded(3, 2), "expected at least 3 for this data set, found 2");
  EXPECT_EQ(bounded(0, 1), "expected at least 4 for this data set, found 1");
  EXPECT_EQ(bounded(0, 4), "");
}

TEST(SceneResolver, FillsInWhereClippingIs) {
  const SceneResolver resolver(testing::smallStore(), {1'000'000});
  const auto plain = resolver.replace(json::object());
  EXPECT_TRUE(plain->render.clip.empty());
  EXPECT_FALSE(plain->render.crop);
  EXPECT_EQ(resolver.replace(toJson(plain->resolved))->render, plain->render);
  const auto& grid = plain->dataset->grid();
  EXPECT_EQ(toJson(plain->resolved)["crop"]["x"], json({-0.5, grid.dims.x - 0.5}));
  const auto clipped =
      resolver.replace({{"clip", {json::object(), {{"media", {1}}}}}, {"crop", {{"y", {1, 1.5}}}}});
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  EXPECT_EQ(toJson(clipped->resolved)["clip"][0]["point"], json({centre.x, centre.y, centre.z}));
  EXPECT_EQ(clipped->render.clip.at(0), (ClipPlane{centre, {0, 0, 1}, {}}));
  EXPECT_EQ(clipped->render.clip.at(1).channels, std::vector<int>{1});
  ASSERT_TRUE(clipped->render.crop);
  EXPECT_EQ(clipped->render.crop->low, glm::dvec3(-0.5, 1, -0.5));
  EXPECT_EQ(clipped->render.crop->regions, Crop::kInnermost);
  // Sent back, the resolved scene is the same scene.
  EXPECT_EQ(resolver.replace(toJson(clipped->resolved))->render, clipped->render);
}

TEST(SceneResolver, RefusesWhatTheRendererWouldRefuseLater) {
  using Expected = std::pair<int, std::string>;
  const json far = {1e308, 1e308, 1e308};
  EXPECT_EQ(errorOf({{"clip", {{{"normal", {0, 0, 0}}}}}}), Expected(422, "/clip/0/normal"));
  EXPECT_EQ(errorOf({{"clip", {json::object(), {{"point", far}}}}}), Expected(422, "/clip/1"));
  EXPECT_EQ(errorOf({{"clip", {{{"media", {2}}}}}}), Expected(422, "/clip/0"));
  EXPECT_EQ(errorOf({{"crop", {{"z", {2, 1}}}}}), Expected(422, "/crop/z"));
  EXPECT_EQ(errorOf({{"lights", {{{"type", "headlight"}}, {{"type", "point"}, {"position", far}}}}}),
            Expected(422, "/lights/1"));
  EXPECT_EQ(errorOf({{"lights", {{{"direction", far}}}}}), Expected(422, "/lights/0"));
  EXPECT_EQ(errorOf({{"camera", {{"eye", far}, {"target", {-1e308, -1e308, -1e308}}}}}),
            Expected(422, "/camera"));
}

TEST(SceneResolver, ChecksAPatchAgainstTheDatasetThatItNames) {
  const auto resolve = resolver();
  const auto base = resolve.replace(json::object());
  EXPECT_EQ(resolve.patch(*base, {{"dataset", "other"}})->dataset->id(), "other");
  EXPECT_EQ(
      resolve.patch(*resolve.patch(*base, {{"dataset", "other"}}), {{"dataset", nullptr}})->dataset->id(),
      "small");
  EXPECT_THROW(resolve.patch(*base, {{"dataset", "none"}}), ProtocolError);
}

/// One channel of 64^3 voxels: a ball of 200 in a corner, a larger one of 100 around it, 0 elsewhere.
SceneResolver resolverOfBalls() {
  Grid grid;
  grid.dims = glm::ivec3(64);
  std::vector<ChannelSource> channels(1);
  channels[0].voxels = VoxelBuffer(ScalarType::u8, grid.voxelCount());
  for (std::size_t i = 0; i < grid.voxelCount(); ++i) {
    const glm::dvec3 p(double(i % 64), double(i / 64 % 64), double(i / 4096));
    const double r = glm::length(p - 20.0);
    channels[0].voxels.as<std::uint8_t>()[i] = r <= 6 ? 200 : r <= 16 ? 100 : 0;
  }
  std::vector<io::LoadedDataset> datasets;
  datasets.push_back({"balls", "balls", {}, std::make_shared<const Volume>(grid, std::move(channels))});
  return {std::make_shared<const DatasetStore>(std::move(datasets)), {1'000'000}};
}

json rangeFrom(double lo) { return {{"channels", {{{"range", {lo, 255}}, {"density", 1}}}}}; }

/// Distance from the eye to the target.
double distanceOf(const ResolvedScene& scene) {
  return glm::length(scene.render.camera.eye - scene.render.camera.target);
}

TEST(SceneResolver, FramesWhatTheCurvesOfTheSceneShow) {
  const auto resolve = resolverOfBalls();
  const auto inner = resolve.replace(rangeFrom(150)), outer = resolve.replace(rangeFrom(50)),
             nothing = resolve.replace(rangeFrom(220));
  EXPECT_LT(glm::length(inner->render.camera.target - 20.0), 1.5);
  EXPECT_LT(glm::length(outer->render.camera.target - 20.0), 1.5);
  EXPECT_LT(distanceOf(*inner), 0.6 * distanceOf(*outer));
  EXPECT_EQ(nothing->render.camera, framingCamera(nothing->dataset->grid(), 35, 1));
  EXPECT_EQ(resolve.replace(rangeFrom(150))->resolved, inner->resolved);
}

TEST(SceneResolver, KeepsItsViewWhileCurvesAreEditedUntilItIsAskedForAnew) {
  const auto resolve = resolverOfBalls();
  const auto first = resolve.replace(rangeFrom(50));
  const json narrow = {{"channels", {{"0", {{"range", {150, 255}}}}}}};
  const auto edited = resolve.patch(*first, narrow);
  EXPECT_EQ(edited->render.camera, first->render.camera);
  EXPECT_EQ(resolve.patch(*edited, {{"channels", {{"0", {{"visible", false}}}}}})->render.camera,
            first->render.camera);
  // Another angle of view frames the same.
  const auto wide = resolve.patch(*edited, {{"camera", {{"fovY", 60}}}});
  EXPECT_EQ(wide->render.camera.target, first->render.camera.target);
  EXPECT_LT(distanceOf(*wide), distanceOf(*first));
  const auto moved = resolve.patch(*edited, {{"camera", {{"eye", {1, 2, 99}}, {"target", {20, 20, 20}}}}});
  const Camera anew = resolve.replace(rangeFrom(150))->render.camera;
  for (const json& reset :
       {json{{"camera", nullptr}}, json{{"camera", {{"eye", nullptr}, {"target", nullptr}}}}}) {
    EXPECT_EQ(resolve.patch(*moved, reset)->render.camera, anew) << reset;
    EXPECT_EQ(resolve.patch(*edited, reset)->render.camera, anew) << reset;
  }
}

TEST(SceneResolver, FramesAnotherDatasetByItself) {
  const auto resolve = resolver();
  const auto base = resolve.replace({{"channels", {{{"range", {10, 23}}}, {{"visible", false}}}}});
  const auto other = resolve.patch(*base, {{"dataset", "other"}, {"channels", nullptr}});
  EXPECT_NE(base->render.camera, other->render.camera);
  EXPECT_EQ(other->render.camera, resolve.replace({{"dataset", "other"}})->render.camera);
}

TEST(SceneResolver, TakesColoursAndWindowsThatTheFileStatesAsDefaults) {
  const auto resolverOf = [](std::size_t count) {
    std::vector<ChannelSource> channels(count);
    for (ChannelSource& channel : channels) {
      channel.voxels = VoxelBuffer(ScalarType::u8, 1);
      channel.voxels.as<std::uint8_t>()[0] = 7;
    }
    channels[0].look = {.color = {{0, 128, 255}}, .window = ValueRange{-1, 2.5}};
    std::vector<io::LoadedDataset> datasets;
    datasets.push_back({"d", "d", {}, std::make_shared<const Volume>(Grid{}, std::move(channels))});
    return SceneResolver(std::make_shared<const DatasetStore>(std::move(datasets)), {1'000'000});
  };
  for (const std::size_t count : {1u, 2u}) {
    const auto scene = resolverOf(count).replace(json::object());
    EXPECT_EQ(scene->resolved.channels[0].color, "#0080ff");
    EXPECT_EQ(scene->render.channels[0].rangeLo, -1);
    EXPECT_EQ(scene->render.channels[0].rangeHi, 2.5);
    const auto edited =
        resolverOf(count).replace({{"channels", {{{"color", "#ff0000"}, {"range", {0, 9}}}}}});
    EXPECT_EQ(edited->resolved.channels[0].color, "#ff0000");
    EXPECT_EQ(edited->render.channels[0].rangeHi, 9);
  }
  EXPECT_EQ(resolverOf(2).replace(json::object())->resolved.channels[1].color, "#35c9ff");
}

/// Values 0, 1, 4, 9 and 16 in a row, two world units apart: their gradients are 1, 2, 4, 6 and 7 per voxel,
/// and the steepest 3.5 per world unit; and a data set without a gradient.
SceneResolver resolverOfSquares() {
  Grid grid;
  grid.dims = {5, 1, 1};
  grid.worldFromVoxel[0][0] = 2;
  std::vector<io::LoadedDataset> datasets;
  for (const char* id : {"squares", "flat"}) {
    std::vector<ChannelSource> channels(2);
    for (ChannelSource& channel : channels) {
      channel.voxels = VoxelBuffer(ScalarType::u8, 5);
      for (std::size_t i = 0; i < 5; ++i)
        channel.voxels.as<std::uint8_t>()[i] = std::uint8_t(datasets.empty() ? i * i : 7);
    }
    datasets.push_back({id, id, {}, std::make_shared<const Volume>(grid, std::move(channels))});
  }
  return {std::make_shared<const DatasetStore>(std::move(datasets)), {1'000'000}};
}

/// End of the automatic range of resolverOfSquares() if `count` voxels count and the steepest is in this bin.
double rangeEnd(int bin, int count) { return (bin + 1 - 0.005 * count) / 256 * 3.5; }

/// A scene whose first channel has opacity that rises from lo to hi, and opacity by the gradient.
json steepFrom(double lo, double hi) {
  return {{"channels", {{{"range", {lo, hi}}, {"gradientOpacity", json::object()}}}}};
}

GradientOpacity steepnessOf(const SceneResolver::Resolved& scene, std::size_t channel = 0) {
  return scene->render.channels[channel].gradientOpacity.value();
}

TEST(SceneResolver, LeavesOpacityByTheGradientOutWhereItIsNotAskedFor) {
  const auto scene = resolverOfSquares().replaceNow(json::object());
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_FALSE(scene->render.channels[i].gradientOpacity);
    EXPECT_FALSE(toJson(scene->resolved)["channels"][i].contains("gradientOpacity"));
  }
}

TEST(SceneResolver, ChoosesTheRangeOfGradientsByWhatHasOpacity) {
  const auto resolve = resolverOfSquares();
  // 0, 1 and 4 have opacity, 9 has none. A gradient of 4 per voxel, of at most 7, is in bin 146.
  const auto gentle = resolve.replace(steepFrom(9, 0));
  EXPECT_EQ(steepnessOf(gentle).rangeLo, 0);
  EXPECT_DOUBLE_EQ(steepnessOf(gentle).rangeHi, rangeEnd(146, 3));
  EXPECT_EQ(steepnessOf(gentle).factor, (std::vector<OpacityKnot>{{0, 0}, {1, 1}}));
  EXPECT_EQ(toJson(gentle->resolved)["channels"][0]["gradientOpacity"],
            (json{{"range", {0, steepnessOf(gentle).rangeHi}}, {"points", {{0, 0}, {1, 1}}}}));
  EXPECT_FALSE(gentle->render.channels[1].gradientOpacity);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.replace(steepFrom(4, 16))).rangeHi, rangeEnd(255, 2));
  // If nothing has opacity, all voxels count. If there is no gradient, the range is [0, 1].
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.replace(steepFrom(100, 200))).rangeHi, rangeEnd(255, 5));
  json flat = steepFrom(0, 10);
  flat["dataset"] = "flat";
  EXPECT_EQ(toJson(resolve.replace(flat)->resolved)["channels"][0]["gradientOpacity"]["range"], json({0, 1}));
  // Sent back, the resolved scene is the same scene.
  EXPECT_EQ(resolve.replace(toJson(gentle->resolved))->render, gentle->render);
  EXPECT_EQ(resolve.replace(toJson(gentle->resolved))->resolved, gentle->resolved);
}

TEST(SceneResolver, TakesTheRangeAndTheFactorThatAreGiven) {
  const json curve = {{"range", {3, 0.5}}, {"points", {{0.25, 1}, {0.75, 0}}}};
  const auto scene =
      resolverOfSquares().replaceNow({{"channels", {json::object(), {{"gradientOpacity", curve}}}}});
  EXPECT_EQ(steepnessOf(scene, 1), (GradientOpacity{3, 0.5, {{0.25, 1}, {0.75, 0}}}));
  EXPECT_EQ(toJson(scene->resolved)["channels"][1]["gradientOpacity"], curve);
  EXPECT_FALSE(makeSameFilm(scene->render, resolverOfSquares().replaceNow(json::object())->render));
  EXPECT_EQ(errorOf({{"channels", {{{"gradientOpacity", {{"range", {1}}}}}}}}),
            std::pair(422, std::string("/channels/0/gradientOpacity/range")));
}

TEST(SceneResolver, KeepsTheRangeOfGradientsWhileCurvesAreEditedUntilItIsAskedForAnew) {
  const auto resolve = resolverOfSquares();
  const auto first = resolve.replace(steepFrom(9, 0));
  const double before = rangeEnd(146, 3), anew = rangeEnd(255, 2);
  const auto channel = [](const json& patch) { return json{{"channels", {{"0", patch}}}}; };
  const auto steep = [&](const json& patch) { return channel({{"gradientOpacity", patch}}); };
  const auto edited = resolve.patch(*first, channel({{"range", {4, 16}}}));
  EXPECT_DOUBLE_EQ(steepnessOf(edited).rangeHi, before);
  const auto bent = resolve.patch(*edited, steep({{"points", {{0, 1}}}}));
  EXPECT_DOUBLE_EQ(steepnessOf(bent).rangeHi, before);
  EXPECT_EQ(steepnessOf(bent).factor.size(), 1u);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.patch(*bent, {{"camera", nullptr}})).rangeHi, before);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.patch(*bent, {{"channels", {{"1", nullptr}}}})).rangeHi, before);

  const auto reset = resolve.patch(*bent, steep({{"range", nullptr}}));
  EXPECT_DOUBLE_EQ(steepnessOf(reset).rangeHi, anew);
  EXPECT_EQ(steepnessOf(reset).factor.size(), 1u) << "the points stay";
  const auto off = resolve.patch(*edited, steep(nullptr));
  EXPECT_FALSE(off->render.channels[0].gradientOpacity);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.patch(*off, steep(json::object()))).rangeHi, anew);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.patch(*edited, steepFrom(4, 16))).rangeHi, anew) << "other channels";
  const auto given = resolve.patch(*edited, steep({{"range", {1, 2}}}));
  EXPECT_EQ(steepnessOf(given).rangeHi, 2);
  EXPECT_DOUBLE_EQ(steepnessOf(resolve.patch(*given, steep({{"range", nullptr}}))).rangeHi, anew);
  EXPECT_EQ(steepnessOf(resolve.patch(*edited, {{"dataset", "flat"}})).rangeHi, 1);
}

TEST(SceneResolver, ThrowsUnmeasuredInsteadOfWaitingOnlyWhereItHasToMeasure) {
  const auto resolve = resolverOfSquares();
  const json steep = steepFrom(9, 0);
  json refused = steep;
  refused["lights"] = {{{"direction", {0, 0, 0}}}};
  EXPECT_THROW(resolve.replaceNow(refused), ProtocolError) << "what is refused anyway is not measured";
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_THROW(resolve.replace(steep, stopped.get_token()), Error);
  try {
    resolve.replaceNow(steep);
    FAIL() << "it is not measured yet";
  } catch (const Unmeasured& missing) {
    missing.measure({});
  }
  const auto scene = resolve.replaceNow(steep);
  EXPECT_DOUBLE_EQ(steepnessOf(scene).rangeHi, rangeEnd(146, 3));
  EXPECT_THROW(resolve.patchNow(*scene, {{"channels", {{"1", {{"gradientOpacity", json::object()}}}}}}),
               Unmeasured)
      << "of another channel nothing is known";
}

TEST(SceneResolver, KnowsWhatLeavesThePictureAsItIs) {
  const auto resolve = resolver();
  const auto base = resolve.replace(json::object());
  const auto looksTheSame = [&](const json& patch) {
    const auto patched = resolve.patch(*base, patch);
    EXPECT_EQ(pictureJson(patched->resolved) == pictureJson(base->resolved), makeSameFilm(*patched, *base));
    return makeSameFilm(*patched, *base);
  };
  EXPECT_TRUE(looksTheSame({{"stop", {{"samples", 9}}}}));
  EXPECT_TRUE(looksTheSame({{"channels", {{"0", {{"name", "nucleus"}}}}}}));
  EXPECT_FALSE(looksTheSame({{"channels", {{"0", {{"gamma", 3}}}}}}));
  EXPECT_FALSE(looksTheSame({{"dataset", "other"}}));
  const auto onWhite = resolve.patch(*base, {{"image", {{"background", "#ffffff"}}}});
  EXPECT_NE(pictureJson(onWhite->resolved), pictureJson(base->resolved));
  EXPECT_TRUE(makeSameFilm(*onWhite, *base));
}

TEST(SceneResolver, SharesTheChannelsThatAPatchLeavesAsTheyAre) {
  const SceneResolver resolve = resolver();
  const auto base = resolve.replace({{"channels", {{{"gamma", 2}}, {{"gamma", 3}}}}});
  const auto entry = [](const SceneResolver::Resolved& scene, std::size_t i) {
    return scene->sparse.channel(i).get();
  };
  const auto moved = resolve.patch(*base, {{"camera", {{"fovY", 20}}}});
  EXPECT_EQ(entry(moved, 0), entry(base, 0));
  EXPECT_EQ(entry(moved, 1), entry(base, 1));
  const auto edited = resolve.patch(*moved, {{"channels", {{"1", {{"weight", 2}}}}}});
  EXPECT_EQ(entry(edited, 0), entry(base, 0));
  EXPECT_EQ(edited->sparse.whole(), json::parse(R"({"camera": {"fovY": 20},
      "channels": [{"gamma": 2}, {"gamma": 3, "weight": 2}]})"));
  EXPECT_EQ(edited->resolved, resolve.replace(edited->sparse.whole())->resolved);
  const auto fresh = resolve.patch(*edited, {{"channels", nullptr}});
  EXPECT_EQ(fresh->sparse.whole(), (json{{"camera", {{"fovY", 20}}}}));
}

TEST(SceneResolver, PatchesAsAWholeSceneIsPatched) {
  const SceneResolver resolve = resolver();
  const std::vector<json> patches = {
      {{"channels", {{"1", {{"opacity", {{0, 0}, {1, 0.5}}}}}}}},
      {{"channels", {{"0", {{"color", "#ff0000"}}}, {"1", {{"opacity", {{"1", {1, 0.25}}}}}}}}},
      {{"camera", {{"fovY", 20}}}, {"channels", {{"0", {{"colormap", "fire"}}}}}},
      {{"channels", {{"1", nullptr}}}},
      {{"channels", json::array({json::object(), {{"gamma", 2}}})}},
      {{"channels", json::array({{{"gamma", 3}}})}},
      {{"channels", {{"1", {{"visible", false}}}}}},
      {{"channels", json::array()}},
      {{"channels", nullptr}},
      {{"stop", {{"samples", 3}}}}};
  auto scene = resolve.replace(json::object());
  json whole = json::object();
  for (const json& patch : patches) {
    scene = resolve.patch(*scene, patch);
    whole = protocol::applyPatch(whole, patch, 2);
    EXPECT_EQ(scene->sparse.whole(), whole) << patch;
    EXPECT_EQ(scene->resolved, resolve.replace(whole)->resolved) << patch;
  }
}

/// Curves of `count` control points in the first channel.
json longCurves(int count) {
  json opacity = json::array(), colors = json::array();
  for (int i = 0; i < count; ++i) {
    opacity.push_back({double(i) / count, 0.5});
    colors.push_back(json::array({double(i) / count, "#102030"}));
  }
  return {{"channels", {{{"opacity", opacity}, {"colormap", colors}}}},
          {"image", {{"width", 64}, {"height", 64}}}};
}

TEST(SceneResolver, RefusesPicturesForWhichThereIsNeverMemory) {
  const SceneResolver resolve(testing::smallStore(),
                              {.maxPixels = 16'777'216, .memory = std::make_shared<MemoryBudget>(64 << 20)});
  const auto scene = [](int width) { return json{{"image", {{"width", width}, {"height", 700}}}}; };
  // 81 bytes a pixel for the film, 16 for the picture, 11 for its JPEG.
  const auto fits = resolve.replace(scene(880));
  try {
    resolve.patch(*fits, scene(890));
    FAIL() << "no error";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_EQ(error.pointer, "/image");
    EXPECT_STREQ(
        error.what(),
        "expected a picture that needs at most 64 MiB of memory, found 890 x 700 pixels, which need 65 "
        "MiB");
  }
  EXPECT_EQ(resolve.tooLarge(fits->render, false), std::nullopt);
  EXPECT_NE(resolve.tooLarge(fits->render, true), std::nullopt);
  EXPECT_EQ(resolve.tooLarge(resolve.replace(scene(500))->render, true), std::nullopt);
}

TEST(SceneResolver, LeavesPicturesToTheLastQuarterOfTheMemoryButNoLargeFilms) {
  const SceneResolver resolve(
      testing::smallStore(), {.maxPixels = 16'777'216, .memory = std::make_shared<MemoryBudget>(1000 << 20)});
  Scene scene;
  scene.channels.resize(2);
  scene.height = 2000;
  scene.width = 4800;  // a film of 742 MiB, with picture and JPEG 989
  EXPECT_EQ(resolve.tooLarge(scene, false), std::nullopt);
  scene.width = 4900;  // a film of 757 MiB, of which 750 are allowed
  EXPECT_NE(resolve.tooLarge(scene, false), std::nullopt);
}

TEST(SceneResolver, ChargesScenesWithLongCurvesToTheMemoryOfRequests) {
  const auto memory = std::make_shared<MemoryBudget>(2 << 20);
  const SceneResolver resolve(testing::smallStore(), {.maxPixels = 16'777'216, .memory = memory});
  {
    const auto ordinary = resolve.replace(longCurves(100));
    EXPECT_EQ(memory->used(MemoryUse::scenes), 0u);
    const auto one = resolve.replace(longCurves(4096));
    EXPECT_EQ(memory->used(MemoryUse::scenes), 4096u * (128 + 216));
    try {
      resolve.patch(*one, {{"camera", {{"fovY", 20}}}});
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::busy);
      EXPECT_STREQ(error.what(),
                   "memory for scenes: expected at most 2 MiB, of which 2 MiB are in use, found 2 MiB");
    }
    EXPECT_NO_THROW(resolve.patch(*one, {{"channels", nullptr}}));
    EXPECT_NO_THROW(resolve.patch(*ordinary, {{"camera", {{"fovY", 20}}}}));
  }
  EXPECT_EQ(memory->used(MemoryUse::scenes), 0u);
}

}  // namespace
}  // namespace scolopax::server
