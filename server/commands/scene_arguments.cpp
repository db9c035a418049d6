// SPDX-License-Identifier: Apache-2.0
#include "server/commands/scene_arguments.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "protocol/json_text.h"
#include "renderer/core/error.h"
#include "server/commands/load_bar.h"
#include "server/config.h"
#include "server/dataset_store.h"

namespace scolopax {
namespace {

using nlohmann::json;

json readScene(const std::string& path) {
  if (path.empty()) return json::object();
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  if (!file || !(text << file.rdbuf())) throw Error(ErrorCode::io, path + ": cannot be read");
  return protocol::parseJson(text.str(), {});
}

/// "channels.0.density=0.1" as the merge patch {"channels": {"0": {"density": 0.1}}}.
json patchOf(const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    throw CLI::ValidationError("--set", "expected PATH=VALUE, found '" + assignment + "'");
  const std::string text = assignment.substr(equals + 1);
  json patch = json::parse(text, nullptr, false);
  if (patch.is_discarded()) patch = text;
  std::vector<std::string> keys;
  std::stringstream path(assignment.substr(0, equals));
  for (std::string key; std::getline(path, key, '.');) keys.push_back(key);
  if (assignment[equals - 1] == '.') keys.emplace_back();  // getline drops an empty last part
  if (std::find(keys.begin(), keys.end(), "") != keys.end())
    throw CLI::ValidationError("--set",
                               "expected names between the dots of PATH=VALUE, found '" + assignment + "'");
  for (auto key = keys.rbegin(); key != keys.rend(); ++key) patch = json{{*key, std::move(patch)}};
  return patch;
}

}  // namespace

void addSceneArguments(CLI::App& command, SceneArguments& arguments) {
  command.add_option("SCENE", arguments.scene,
                     "Scene file (JSON, see PROTOCOL.md); by default, all values are chosen automatically");
  command.add_option("--data", arguments.data, kDataDoc)->required();
  addDataOptions(command, arguments.dataOptions);
  command.add_option("--time", arguments.time, "Which time of a time series, from 0: the scene's `time`");
  command
      .add_option(
          "--set", arguments.assignments,
          "Set a field of the scene, e.g. channels.0.density=0.1; a value that is not JSON is a string")
      ->allow_extra_args(false);
}

std::shared_ptr<const server::ResolvedScene> resolveScene(const SceneArguments& arguments) {
  std::vector<json> patches;
  if (arguments.time) patches.push_back({{"time", *arguments.time}});
  for (const std::string& assignment : arguments.assignments) patches.push_back(patchOf(assignment));
  const json scene = readScene(arguments.scene);
  const auto warn = [](const std::string& line) { fmt::print(stderr, "scolopax: {}\n", line); };
  const auto opened = io::openDatasets(arguments.data, openOptionsOf(arguments.dataOptions, warn));
  const auto store = std::make_shared<server::DatasetStore>(
      opened, std::make_shared<server::VolumeCache>(io::defaultMemoryLimitBytes(), warn));
  LoadBar bar;
  bar.follow(store);
  const server::SceneResolver resolver(store, {.maxPixels = server::Config().maxPixels});
  auto resolved = resolver.replace(scene);
  for (const json& patch : patches) resolved = resolver.patch(*resolved, patch);
  // Resolved again as a whole, so that the automatic view fits the final curves.
  return patches.empty() ? resolved : resolver.replace(resolved->sparse.whole());
}

void checkOutputs(const std::vector<std::filesystem::path>& outputs, const SceneArguments& arguments) {
  const auto canonical = [](const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::weakly_canonical(path, ignored);
  };
  std::vector<std::filesystem::path> taken;
  for (const auto& name : arguments.data) taken.push_back(canonical(io::splitName(name).path));
  if (!arguments.scene.empty()) taken.push_back(canonical(arguments.scene));
  for (const auto& path : outputs) {
    if (std::find(taken.begin(), taken.end(), canonical(path)) != taken.end())
      throw CLI::ValidationError(path.string(), "expected a file that is not another input or output");
    taken.push_back(canonical(path));
  }
}

}  // namespace scolopax
