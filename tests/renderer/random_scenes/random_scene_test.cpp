// SPDX-License-Identifier: Apache-2.0
// Random scenes cover every field of the protocol, and can be rendered again from their files.
#include "tests/renderer/random_scenes/random_scene.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "protocol/schema.h"
#include "renderer/io/datasets.h"
#include "server/scene_resolver.h"

namespace scolopax::random_scenes {
namespace {

using nlohmann::json;

/// Calls visit("/channels/#/gamma") and so on for every field that is not an object (or null) or a list of
/// objects.
template <class Visit>
void forEachField(const json& schema, const json& object, const std::string& path, const Visit& visit) {
  const auto target = [&](const json& reference) -> const json& {
    return schema.at(json::json_pointer(reference.at("$ref").get<std::string>().substr(1)));
  };
  for (const auto& [name, field] : object.at("properties").items()) {
    const json* inner = nullptr;
    std::string innerPath = path + "/" + name;
    if (field.contains("$ref")) inner = &target(field);
    if (field.contains("anyOf") && field["anyOf"][0].contains("$ref")) inner = &target(field["anyOf"][0]);
    if (field.contains("items") && field["items"].contains("$ref")) {
      inner = &target(field["items"]);
      innerPath += "/#";
    }
    if (inner && inner->contains("properties"))
      forEachField(schema, *inner, innerPath, visit);
    else
      visit(path + "/" + name);
  }
}

/// Adds the values at a path of a scene; `#` means every element.
void collect(const json& value, const std::string& path, std::set<std::string>* found) {
  if (path.empty()) {
    found->insert(value.dump());
    return;
  }
  const std::size_t end = path.find('/', 1);
  const std::string name = path.substr(1, end == std::string::npos ? end : end - 1);
  const std::string rest = end == std::string::npos ? "" : path.substr(end);
  if (name == "#")
    for (const json& element : value) collect(element, rest, found);
  else if (value.contains(name))  // null contains nothing
    collect(value.at(name), rest, found);
}

TEST(RandomScene, DrawsEveryFieldOfTheSchema) {
  const json schema = json::parse(protocol::schemaText(server::rendererLists()));
  std::vector<json> scenes;
  for (std::uint64_t number = 0; number < 200; ++number) scenes.push_back(drawScene(number).wire);
  const std::set<std::string> notPartOfAPicture{"/dataset", "/time", "/channels/#/name", "/stop/samples",
                                                "/stop/seconds"};
  forEachField(schema, schema, "", [&](const std::string& path) {
    if (notPartOfAPicture.contains(path)) return;
    std::set<std::string> found;
    for (const json& scene : scenes) collect(scene, path, &found);
    EXPECT_GT(found.size(), 1u) << path << ": add it to the lists of random_scene.cpp";
  });
}

TEST(RandomScene, IsTheSameAgainFromItsFiles) {
  const std::string folder = testing::TempDir() + "random_scene";
  for (std::uint64_t number = 0; number < 40; ++number) {
    const RandomScene drawn = drawScene(number);
    std::filesystem::remove_all(folder);
    writeScene(drawn, folder);
    std::vector<std::filesystem::path> files;
    for (std::size_t n = 0; n < drawn.source.channels.size(); ++n)
      files.push_back(folder + "/channel_" + std::to_string(n) + ".nii");
    const auto datasets = io::loadDatasets(files, 1 << 20, [](const std::string&) {});
    ASSERT_EQ(datasets.size(), 1u) << number;
    const Volume& volume = *datasets[0].volume;
    EXPECT_TRUE(volume.grid().worldFromVoxel == drawn.volume->grid().worldFromVoxel) << number;
    for (std::size_t n = 0; n < files.size(); ++n) {
      const Channel &a = volume.channels()[n], &b = drawn.volume->channels()[n];
      ASSERT_EQ(a.voxels.type(), b.voxels.type()) << number;
      EXPECT_EQ(a.slope, b.slope) << number;
      EXPECT_EQ(a.intercept, b.intercept) << number;
      visitScalarType(a.voxels.type(), [&](auto zero) {
        using T = decltype(zero);
        const auto p = a.voxels.as<T>(), q = b.voxels.as<T>();
        for (std::size_t i = 0; i < p.size(); ++i)
          EXPECT_EQ(std::memcmp(&p[i], &q[i], sizeof(T)), 0)
              << number << ": voxel " << i << " of channel " << n;
      });
    }
    json scene;
    std::ifstream(folder + "/scene.json") >> scene;
    const server::SceneResolver resolver(std::make_shared<server::DatasetStore>(datasets), {16'777'216});
    EXPECT_TRUE(resolver.replace(scene)->render == drawn.scene) << number;
  }
}

}  // namespace
}  // namespace scolopax::random_scenes
