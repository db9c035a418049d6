// SPDX-License-Identifier: Apache-2.0
// The questions that are asked of every random scene. Each is asked twice: a quick look at about four
// standard errors sends what stands out to a long one, with other random numbers, which alone decides.
//
// Chances of a wrong alarm: the long look takes an empirical Bernstein inequality at kLogTerm for every
// pixel, component and level: 4 exp(-34) x 2e7 (20,000 scenes, 7 methods, 21 means, 4 components, 2 levels) <
// 2e-7.
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

/// Compares the reference with the tester's own march, then every method in the renderer's list with the
/// reference.
std::vector<Finding> checkScene(const RandomScene& scene);

}  // namespace scolopax::random_scenes
