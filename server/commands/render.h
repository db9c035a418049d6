// SPDX-License-Identifier: Apache-2.0
// scolopax render: one picture of a scene, into a file.
#pragma once
namespace CLI {
class App;
}

namespace scolopax {

/// Adds `render [SCENE.json] --data PATH... -o OUT ...`. Its callback throws on failure.
CLI::App* addRenderCommand(CLI::App& root);

}  // namespace scolopax
