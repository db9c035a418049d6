// SPDX-License-Identifier: Apache-2.0
// The arguments that define the scene to render: SCENE, --data, --time and --set.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/commands/data_options.h"
#include "server/scene_resolver.h"

namespace scolopax {

struct SceneArguments {
  std::string scene;  ///< a file; "" is {}
  std::vector<std::filesystem::path> data;
  DataOptions dataOptions = {};
  std::optional<std::uint32_t> time = {};     ///< replaces the scene's
  std::vector<std::string> assignments = {};  ///< "channels.0.density=0.1"
};

/// Adds SCENE, --data, --fourth-axis, --allow-host, --time and --set, which fill `arguments`. `arguments`
/// must live as long as the command.
void addSceneArguments(CLI::App& command, SceneArguments& arguments);

/// Loads the data, reads the scene and applies the assignments in order. Throws Error or ProtocolError.
/// Throws CLI::ValidationError for a malformed assignment, before anything is loaded.
std::shared_ptr<const server::ResolvedScene> resolveScene(const SceneArguments& arguments);

/// Throws CLI::ValidationError if two outputs are the same file or if an output would overwrite an input.
void checkOutputs(const std::vector<std::filesystem::path>& outputs, const SceneArguments& arguments);

}  // namespace scolopax
