// SPDX-License-Identifier: Apache-2.0
// The ray caster of Knoll et al. 2009: postclassification or preintegration, peak finding, and sampling by a
// StepLaw, for one channel. One ray at a time, like the paper's shader, following its Algorithm 1.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/vec4.hpp>
#include <vector>

#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/shade.h"
#include "tests/bench/peaks/peak_table.h"
#include "tests/bench/peaks/preintegrated_table.h"
#include "tests/bench/peaks/step_law.h"

namespace scolopax::peaks {

/// The paper's DVR_ONLY, default, PEAK_XOR_DVR and PEAK_ONLY.
enum class Mode { off, both, either, only };

struct Counts {
  std::uint64_t samples = 0;   ///< evaluations of the scalar, including those of peak finding
  std::uint64_t gradient = 0;  ///< further fetches for shading
};

struct Casting {
  const kernel::SceneView& scene;  ///< of one channel, with the curve and without surfaces
  StepLaw law;
  const PreintegratedTable* means;  ///< null: postclassification
  const PeakTable* peaks;           ///< unused with Mode::off
  Mode mode;
  const std::vector<int>* rates;  ///< of macrocells (cell_rates.h); null: 1
  float opaque;                   ///< transmittance at which rays end
  bool growing;                   ///< steps grow as a ray's light is absorbed
  float even;                     ///< steps double, up to 8 at once, while positions change by less; 0: never
};

class RayCaster {
 public:
  explicit RayCaster(const Casting& casting)
      : c_(casting), scene_(casting.scene), channel_(casting.scene.channels[0]) {}

  /// Linear premultiplied RGBA of the ray through the pixel's centre.
  glm::vec4 operator()(int x, int y, Counts& counts) const {
    const kernel::CameraRays& rays = scene_.rays;
    const float px = float(x) + 0.5f, py = float(y) + 0.5f;
    const double sx = double(px - rays.halfSize.x) * double(rays.pixelSize);
    const double sy = double(rays.halfSize.y - py) * double(rays.pixelSize);
    Path path{rays(px, py), {}, 0, counts};
    path.inside = kernel::clipToScene<kernel::One>(scene_, path.ray);
    path.toEye = double(rays.start) * std::sqrt(1 + double(rays.perspective) * (sx * sx + sy * sy));
    if (path.inside.enter < path.inside.exit) {
      kernel::CellWalk walk(path.ray, path.inside, scene_.majorants);
      do {
        if (scene_.majorants.total(walk.index()) > 0)
          crossCell(path, double(walk.enter()), double(walk.exit()),
                    c_.rates ? (*c_.rates)[walk.index()] : 1);
      } while (!ended(path) && walk.advance());
    }
    return glm::vec4(path.color, 1 - path.transmittance);
  }

 private:
  struct Sample {
    double t = 0;
    glm::vec3 point{0};
    float position = 0;  ///< on the curves; not clamped, so that the secant method sees a smooth function
  };
  struct Path {
    kernel::Ray ray;
    kernel::Interval inside;
    double toEye;  ///< distance of the ray's origin from the eye
    Counts& counts;
    std::int64_t next = 0;         ///< number of the first sample that has not been passed
    std::int64_t lastNumber = -1;  ///< of `last`
    int stride = 1;                ///< steps at once, by `even`
    Sample last{};
    glm::vec3 color{0};
    float transmittance = 1;
  };

  bool ended(const Path& path) const { return path.transmittance < c_.opaque; }

  /// Takes the samples from the last one before a macrocell to the first one behind it, except those already
  /// taken in the previous macrocell.
  void crossCell(Path& path, double enter, double exit, int rate) const {
    const auto first = std::int64_t(std::floor(c_.law.indexAt(enter + path.toEye)));
    const auto end = std::int64_t(std::ceil(c_.law.indexAt(exit + path.toEye)));
    path.next = std::max(path.next, first);
    while (path.next < end && !ended(path)) {
      const std::int64_t from = path.next;
      const float before = path.last.position;
      std::int64_t steps = std::int64_t(rate) * path.stride;
      if (c_.growing) steps = std::int64_t(float(steps) / std::sqrt(std::sqrt(path.transmittance)));
      path.next = std::min(from + steps, end);
      crossSegment(path, from, path.next);
      const bool isEven = path.lastNumber == path.next && std::abs(path.last.position - before) < c_.even;
      path.stride = isEven ? std::min(2 * path.stride, 8) : 1;
    }
  }

  /// A segment from one sample to another, cut off at the volume's box.
  void crossSegment(Path& path, std::int64_t from, std::int64_t to) const {
    const double t0 = std::max(c_.law.at(from) - path.toEye, double(path.inside.enter));
    const double t1 = std::min(c_.law.at(to) - path.toEye, double(path.inside.exit));
    if (!(t0 < t1)) return;
    Sample front;
    front.t = t0;
    if (path.lastNumber == from)
      front = path.last;
    else if (c_.means || c_.mode != Mode::off)  // postclassification needs the back alone
      front = sampleAt(path, t0);
    const Sample back = sampleAt(path, t1);
    path.last = back;
    path.lastNumber = to;

    bool listed = false;
    if (c_.mode != Mode::off)
      listed = c_.peaks->visit(front.position, back.position,
                               [&](const PeakSurface& peak) { findPeak(path, front, back, peak); });
    // As in Algorithm 1, a segment for which the table lists a peak has no matter, whether it crosses the
    // peak or not.
    if (c_.mode == Mode::only || (c_.mode == Mode::either && listed)) return;
    addMatter(path, front, back);
  }

  /// Crossing of a peak by the rule of signs and three steps of the secant method, which needs two samples.
  void findPeak(Path& path, const Sample& front, const Sample& back, const PeakSurface& peak) const {
    double t0 = front.t, t1 = back.t;
    double f0 = double(front.position) - double(peak.position),
           f1 = double(back.position) - double(peak.position);
    if (!(f0 * f1 < 0)) return;
    const auto root = [&] { return t0 - (t1 - t0) * f0 / (f1 - f0); };
    for (int step = 0; step < 2; ++step) {
      const double t = root(), f = double(sampleAt(path, t).position) - double(peak.position);
      if (f * f0 < 0) {
        t1 = t;
        f1 = f;
      } else {
        t0 = t;
        f0 = f;
      }
    }
    const double t = root();
    add(path, peak.opacity, lit(path, t, pointAt(path, t), peak.color, true));
  }

  /// The matter of a segment, lit at its back.
  void addMatter(Path& path, const Sample& front, const Sample& back) const {
    PreintegratedTable::Mean mean;
    if (c_.means) {
      mean = c_.means->between(front.position, back.position);
    } else {
      const float position = kernel::clamp(back.position, 0.0f, 1.0f);
      mean = {kernel::evaluate(channel_.color, position), kernel::extinctionAt(channel_, position)};
    }
    if (!(mean.extinction > 0)) return;
    const float opacity = kernel::absorbed(mean.extinction * float(back.t - front.t));
    add(path, opacity, lit(path, back.t, back.point, mean.color, false));
  }

  static void add(Path& path, float opacity, const glm::vec3& light) {
    path.color += path.transmittance * opacity * light;
    path.transmittance *= 1 - opacity;
  }

  static glm::vec3 pointAt(const Path& path, double t) {
    return path.ray.origin + float(t) * path.ray.direction;
  }
  Sample sampleAt(Path& path, double t) const {
    ++path.counts.samples;
    const glm::vec3 point = pointAt(path, t);
    const float stored = kernel::sampleStored<kernel::One>(channel_.field, scene_.dims, point);
    return {t, point, (stored - channel_.origin) * channel_.scale + channel_.offset};
  }

  /// The renderer's own shading, so that pictures differ only in the positions and the number of samples.
  glm::vec3 lit(Path& path, double t, const glm::vec3& point, const glm::vec3& color, bool onSurface) const {
    if (!scene_.shading) return color;
    using kernel::One;
    const kernel::LitPoint<One> hit{path.ray, float(t), point};
    const auto unshadowed = [](const kernel::Ray&, const kernel::Interval&) { return 1.0f; };
    const auto visibility = kernel::visibilityAt<One>(scene_, hit, true, unshadowed);
    kernel::SampleCost cost;
    const glm::vec3 light =
        kernel::lit<One>(scene_, channel_, color, hit, visibility, true, onSurface, &cost);
    path.counts.gradient += cost.fetches;
    return light;
  }

  Casting c_;
  const kernel::SceneView& scene_;
  const kernel::ChannelView& channel_;
};

}  // namespace scolopax::peaks
