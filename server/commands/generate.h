// SPDX-License-Identifier: Apache-2.0
// scolopax generate: data sets made from formulas.
#pragma once
namespace CLI {
class App;
}

namespace scolopax {

/// Adds `generate orbitals OUT.nrrd [--size N] [--channels K]`. Its callback throws Error on failure.
CLI::App* addGenerateCommand(CLI::App& root);

}  // namespace scolopax
