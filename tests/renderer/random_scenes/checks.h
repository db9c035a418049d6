// SPDX-License-Identifier: Apache-2.0
// The checks of every random scene. Each has two stages: a deviation beyond about four standard errors in a
// quick check leads to a long check with other random numbers, and only that one decides.
//
// False-alarm probability: the long check uses an empirical Bernstein inequality at kLogTerm for every pixel,
// component and level: 4 exp(-34) x 2e7 (20,000 scenes, 7 methods, 21 means, 4 components, 2 levels) < 2e-7.
#pragma once
#include <string>
#include <vector>

#include "tests/renderer/random_scenes/random_scene.h"

namespace scolopax::random_scenes {

inline constexpr double kLogTerm = 34;

struct Finding {
  std::uint64_t scene;
  std::string what;  ///< "reference", or the method's name
  std::string text;
};

/// Compares the reference with directMarch(), then every method in the renderer's list with the reference.
std::vector<Finding> checkScene(const RandomScene& scene);

}  // namespace scolopax::random_scenes
