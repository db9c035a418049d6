// SPDX-License-Identifier: Apache-2.0
// scolopax reference: the double-precision picture against which errors are measured.
#pragma once
#include <CLI/CLI.hpp>

namespace scolopax {

/// Adds `reference [SCENE.json] --data PATH... -o OUT ...`. Its callback throws Error or ProtocolError on
/// failure.
CLI::App* addReferenceCommand(CLI::App& root);

}  // namespace scolopax
