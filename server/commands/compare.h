// SPDX-License-Identifier: Apache-2.0
// scolopax compare: the difference between two pictures.
#pragma once
namespace CLI {
class App;
}

namespace scolopax {

/// Adds `compare A B [--json]`. Its callback prints on standard output and throws Error on failure.
CLI::App* addCompareCommand(CLI::App& root);

}  // namespace scolopax
