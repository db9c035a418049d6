// SPDX-License-Identifier: Apache-2.0
// Marching with the midpoint rule. A step is halved if halving changes the result, or if its samples result
// from different decisions (knots, signs, holes), which narrows down jumps.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace scolopax::random_scenes {

/// The side of a surface on which a point is; `neither` if the field has no value.
enum class Side : std::uint8_t { below, above, neither };

/// The field at a point of a ray, and a hash of all decisions in its computation.
struct PointSample {
  double extinction = 0;   ///< per world unit
  glm::dvec3 radiance{0};  ///< of a collision there
  std::uint64_t decisions = 0;
  std::vector<Side> sides{};  ///< of every surface
};

/// A stretch of the ray, seen from its start.
struct Stretch {
  double transmittance = 1;
  glm::dvec3 light{0};
};

/// A part of the ray with the same decisions throughout.
struct Run {
  std::uint64_t decisions;
  double length, largestExtinction;
};

struct StepRules {
  double step;         ///< largest length of the initial steps
  double tolerance;    ///< largest change by halving, per step
  double largestRate;  ///< bound of the extinction: a step across a decision may be as thick as `tolerance`
  double largestRadiance;  ///< light is measured relative to this
  int most;                ///< number of samples after which no step is halved any more
};

/// sampleAt(t) returns the PointSample, glanceAt(t) one whose radiance may be wrong, and surfaceAt(k, t) the
/// effect of surface number k where it is crossed at t.
template <class SampleAt, class GlanceAt, class SurfaceAt>
class SteppedMarch {
 public:
  SteppedMarch(const SampleAt& sampleAt, const GlanceAt& glanceAt, const SurfaceAt& surfaceAt,
               const StepRules& rules)
      : sampleAt_(sampleAt), glanceAt_(glanceAt), surfaceAt_(surfaceAt), rules_(rules) {}

  /// Marches the next stretch of the ray. Stretches must follow each other and end where the field has a
  /// kink, or where it is known to jump.
  void march(double begin, double end) {
    if (!(begin < end)) return;
    const int steps = int(std::ceil((end - begin) / rules_.step));
    const double width = (end - begin) / steps;
    std::uint64_t before = glanceAt_(begin + kInset * width).decisions;
    for (int i = 0; i < steps && all_.transmittance > kOpaque; ++i) {
      const double a = begin + i * width, b = i + 1 < steps ? a + width : end;
      const std::uint64_t after = glanceAt_(i + 1 < steps ? b : end - kInset * width).decisions;
      step(a, b, before, after, sampleAt_(0.5 * (a + b)), 0);
      before = after;
    }
  }
  const Stretch& result() const { return all_; }
  const std::vector<Run>& runs() const { return runs_; }
  double error() const { return error_ + (all_.transmittance > kOpaque ? 0 : all_.transmittance); }

 private:
  static constexpr double kOpaque = 1e-9, kThin = 0.1;
  /// Share of a step. A point so far inside its ends is not affected by rounding, which decides at a jump.
  static constexpr double kInset = 1e-9;
  /// Share of the longest step. If a side changes more than once within this length, rounding is the cause.
  static constexpr double kSettled = 1e-7;

  static Stretch slab(const PointSample& sample, double length) {
    const double alpha = -std::expm1(-sample.extinction * length);
    return {1 - alpha, alpha * sample.radiance};
  }
  static Stretch joined(const Stretch& front, const Stretch& back) {
    return {front.transmittance * back.transmittance, front.light + front.transmittance * back.light};
  }

  /// Adds the surfaces between the last sample and this one, which is in the middle of [a, b]. Samples lie
  /// inside cells, so that a value that is only touched at a face is not seen. A side counts from where it
  /// lasts: next to a surface, the rounded value may pass it several times.
  void cross(const PointSample& sample, double a, double b) {
    if (sample.sides == sides_) return;
    const std::vector<Side> ahead = glanceAt_(0.5 * (a + b) + kSettled * rules_.step).sides;
    sides_.resize(ahead.size(), Side::neither);
    for (std::size_t k = 0; k < ahead.size(); ++k) {
      const Side now = sample.sides[k];
      if (now == sides_[k] || now != ahead[k]) continue;
      if (now != Side::neither && sides_[k] != Side::neither)
        all_ = joined(all_, surfaceAt_(k, a + kInset * (b - a)));
      sides_[k] = now;
    }
  }

  void extend(const PointSample& sample, double length) {
    if (runs_.empty() || runs_.back().decisions != sample.decisions)
      runs_.push_back({sample.decisions, 0, 0});
    runs_.back().length += length;
    runs_.back().largestExtinction = std::max(runs_.back().largestExtinction, sample.extinction);
  }

  void step(double a, double b, std::uint64_t before, std::uint64_t after, const PointSample& middle,
            int depth) {
    if (!(all_.transmittance > kOpaque)) return;
    const double half = 0.5 * (b - a), m = 0.5 * (a + b);
    const PointSample left = sampleAt_(0.5 * (a + m)), right = sampleAt_(0.5 * (m + b));
    const Stretch fine = joined(slab(left, half), slab(right, half)), coarse = slab(middle, 2 * half);
    double change = std::abs(fine.transmittance - coarse.transmittance);
    for (int c = 0; c < 3; ++c)
      change = std::max(change, std::abs(fine.light[c] - coarse.light[c]) / rules_.largestRadiance);
    change *= all_.transmittance;
    const bool alike = before == left.decisions && left.decisions == middle.decisions &&
                       middle.decisions == right.decisions && right.decisions == after;
    const double most = alike ? change : all_.transmittance * -std::expm1(-rules_.largestRate * 2 * half);
    // In a thick step all samples lie deep inside and say nothing about its front.
    const bool thin = std::max({left.extinction, middle.extinction, right.extinction}) * 2 * half <= kThin;
    const bool enough = change <= rules_.tolerance && most <= rules_.tolerance && thin;
    samples_ += 2;
    const bool crosses = !alike && !middle.sides.empty();  // perhaps: surfaces are found to the last bit
    if ((enough && !crosses) || samples_ > rules_.most || depth == kMaxDepth || !(a < m && m < b)) {
      error_ += enough ? change : std::max(change, most);
      if (crosses && a < m && m < b && depth < kMaxDepth) error_ += all_.transmittance;  // it may be anywhere
      cross(left, a, m);
      all_ = joined(all_, slab(left, half));
      cross(right, m, b);
      all_ = joined(all_, slab(right, half));
      extend(middle, 2 * half);
      return;
    }
    step(a, m, before, middle.decisions, left, depth + 1);
    step(m, b, middle.decisions, after, right, depth + 1);
  }
  static constexpr int kMaxDepth = 45;

  const SampleAt& sampleAt_;
  const GlanceAt& glanceAt_;
  const SurfaceAt& surfaceAt_;
  StepRules rules_;
  std::vector<Side> sides_;  // of the ray, for every surface
  Stretch all_;
  std::vector<Run> runs_;
  double error_ = 0;
  int samples_ = 0;
};

}  // namespace scolopax::random_scenes
