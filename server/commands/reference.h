// SPDX-License-Identifier: Apache-2.0
// `scolopax reference SCENE`: the double-precision picture that "error" is measured against.
#pragma once
#include <CLI/CLI.hpp>

namespace scolopax {

/// Throws Error or ProtocolError when run.
CLI::App* addReferenceCommand(CLI::App& root);

}  // namespace scolopax
