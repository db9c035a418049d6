// SPDX-License-Identifier: Apache-2.0
// scolopax info: what volume files contain.
#pragma once
namespace CLI {
class App;
}

namespace scolopax {

/// Adds `info PATH... [--json]`. Its callback throws Error on failure.
CLI::App* addInfoCommand(CLI::App& root);

}  // namespace scolopax
