// SPDX-License-Identifier: Apache-2.0
// Measures the points of `bench`, all settings in turns.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/renderer.h"
#include "server/commands/bench_points.h"

namespace scolopax::bench {

/// One renderer for every number of threads.
using Renderers = std::map<int, std::unique_ptr<Renderer>>;

inline constexpr double kLongPicture = 30;  ///< seconds

struct Measurement {
  std::vector<Setting> settings;       ///< with any number of samples; those of one method adjacent
  std::vector<std::uint32_t> samples;  ///< ascending
  /// At least 2, of every point, in turns with those of the others; 2 of those that take longer than
  /// kLongPicture.
  int repetitions;
  /// Numbers of samples that take longer, in seconds, are left out, except the smallest. `automaticLongest`
  /// is for points of Method::automatic without a law of noise.
  double longest, automaticLongest;
  /// If set, samples are doubled until the RMSE is this, or no more samples can help, or one of the limits
  /// above is reached. Needs `truth`.
  std::optional<double> until;
};

/// `truth` may be smaller than the scene's picture by an odd factor: then errors are those of the pixels at
/// the centres of its pixels. `counting` are other renderers, which count costs, since counting takes time.
/// Points are in the order of the settings, and for each in ascending order of samples. Says on stderr what
/// was left out.
std::vector<Point> measure(const Measurement& wanted, const Renderers& renderers, const Renderers& counting,
                           Scene scene, const std::optional<Image>& truth);

}  // namespace scolopax::bench
