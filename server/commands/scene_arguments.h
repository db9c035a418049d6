// SPDX-License-Identifier: Apache-2.0
// The arguments that say what is rendered: SCENE, --data and --set.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/scene_resolver.h"

namespace scolopax {

struct SceneArguments {
  std::string scene;  ///< a file; "" is {}
  std::vector<std::filesystem::path> data;
  std::vector<std::string> assignments;  ///< "channels.0.density=0.1"
};

/// Adds SCENE, --data and --set, which fill `arguments`; it must live as long as the command.
void addSceneArguments(CLI::App& command, SceneArguments& arguments);

/// Loads the data, reads the scene and applies the assignments in their order. Throws Error or ProtocolError,
/// and CLI::ValidationError for an assignment that is none, before anything is loaded.
std::shared_ptr<const server::ResolvedScene> resolveScene(const SceneArguments& arguments);

/// Throws CLI::ValidationError when two of the files are one, or one is to be written over data that is read.
void checkOutputs(const std::vector<std::filesystem::path>& outputs, const SceneArguments& arguments);

}  // namespace scolopax
