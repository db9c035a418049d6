// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>

namespace scolopax {

/// Adds `bench`, which measures speed against error of the methods on one scene.
CLI::App* addBenchCommand(CLI::App& root);

}  // namespace scolopax
