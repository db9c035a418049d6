// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/random_scenes/checks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <sstream>

#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "tests/renderer/random_scenes/direct_march.h"
#include "tests/renderer/random_scenes/draw.h"
#include "tests/renderer/random_scenes/estimates.h"

namespace scolopax::random_scenes {
namespace {

bool isLit(const Scene& scene) { return scene.shading || scene.shadows; }

/// The expected picture, with its mean as the last entry, and bounds on its own error.
struct Truth {
  std::vector<glm::dvec4> mean, slack;
};

Truth referenceOf(const Volume& volume, const Scene& scene, int samplesPerAxis) {
  const auto found = reference::renderReference(volume, scene, samplesPerAxis, scene.seed);
  Truth truth;
  glm::dvec4 sum(0), variance(0);
  const double count = double(found.image.pixels.size());
  for (std::size_t i = 0; i < found.image.pixels.size(); ++i) {
    const glm::dvec4 value(found.image.pixels[i]), noise(found.standardError[i]);
    truth.mean.push_back(value);
    // With few strata, the standard error may miss the variation inside a stratum.
    const double few = scene.filter == PixelFilter::point ? 0 : 2.0 / (samplesPerAxis * samplesPerAxis);
    truth.slack.push_back(8.0 * noise + few + found.maximumRayError);
    sum += value;
    variance += noise * noise;
  }
  truth.mean.push_back(sum / count);
  truth.slack.push_back(8.0 * glm::sqrt(variance) / count + found.maximumRayError);
  return truth;
}

/// Adds the possible effect of rounding in floats: the change of the reference's picture if the eye moves by
/// 3e-7 of the box's diagonal, values change by 3e-7 of the largest value, and gradients by that per voxel.
void addRounding(const RandomScene& drawn, const Scene& scene, Truth* truth) {
  constexpr double kRounding = 3e-7;
  const auto compare = [&](const Scene& changed) {
    const Truth other = referenceOf(*drawn.volume, changed, 1);
    for (std::size_t i = 0; i < truth->mean.size(); ++i)
      truth->slack[i] = glm::max(truth->slack[i], glm::abs(other.mean[i] - truth->mean[i]));
  };
  for (const double sign : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Scene moved = scene;
      moved.camera.eye[axis] += sign * kRounding * drawn.source.grid.diagonal();
      moved.camera.target[axis] += sign * kRounding * drawn.source.grid.diagonal();
      compare(moved);
    }
    Scene shifted = scene;
    for (std::size_t n = 0; n < shifted.channels.size(); ++n) {
      const Histogram& values = drawn.volume->channels()[n].histogram;
      const double size = std::max(std::abs(values.minimum), std::abs(values.maximum));
      shifted.channels[n].rangeLo += sign * kRounding * size;
      shifted.channels[n].rangeHi += sign * kRounding * size;
      for (Isovalue& isovalue : shifted.channels[n].isovalues) isovalue.value += sign * kRounding * size;
      if (auto& opacity = shifted.channels[n].gradientOpacity) {
        const double shift = sign * kRounding * size / drawn.source.grid.smallestSpacing();
        opacity->rangeLo += shift;
        opacity->rangeHi += shift;
      }
    }
    compare(shifted);
  }
}

/// The entry in which an estimate exceeds its allowed error most.
struct Worst {
  std::size_t pixel = 0;
  int component = 0;
  double found = 0, expected = 0, allowed = 0;
  bool beyond() const { return !(std::abs(found - expected) <= allowed); }
};
Worst worstOf(const Estimates& found, const Truth& truth,
              const std::function<double(std::size_t, int)>& allowed) {
  Worst worst;
  double most = -1;
  for (std::size_t i = 0; i < found.mean.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      const double limit = allowed(i, c) + truth.slack[i][c];
      const double off = std::abs(found.mean[i][c] - truth.mean[i][c]) / std::max(limit, 1e-30);
      if (off > most || !(off == off)) {
        most = off == off ? off : 1e300;
        worst = {i, c, found.mean[i][c], truth.mean[i][c], limit};
      }
    }
  return worst;
}

std::string textOf(const Worst& worst, const Estimates& found) {
  std::ostringstream text;
  text.precision(7);
  text << (worst.pixel + 1 == found.mean.size() ? "the picture's mean"
                                                : "pixel " + std::to_string(worst.pixel))
       << " component " << worst.component << ": found " << worst.found << ", expected " << worst.expected
       << " within " << worst.allowed << ", from " << found.count << " values";
  return text.str();
}

class Checks {
 public:
  explicit Checks(const RandomScene& drawn)
      : drawn_(drawn), scene_(drawn.scene), largest_(largestSample(drawn.scene)) {
    // Over a pixel's area the reference needs hundreds of rays: only without light, on which the filter does
    // not depend.
    if (isLit(scene_)) scene_.filter = PixelFilter::point;
  }

  std::vector<Finding> all() {
    checkReference();
    if (!findings_.empty()) return findings_;  // the methods would be compared with it
    quick_ = referenceOf(*drawn_.volume, scene_, kQuickStrata);
    for (std::size_t i = 0; i < std::size(kMethods); ++i) {
      Scene scene = scene_;
      scene.method = Method(i);
      if (scene.method == Method::automatic)
        checkAutomatic(scene);
      else if (hasStep(scene.method))
        checkQuadrature(scene);
      else
        checkTracker(scene);
    }
    return findings_;
  }

 private:
  void report(std::string what, std::string text) {
    findings_.push_back({drawn_.number, std::move(what), std::move(text)});
  }

  void checkReference() {
    Scene scene = scene_;
    scene.filter = PixelFilter::point;
    const int pixels = scene.width * scene.height;
    Draw draw(drawn_.number, "pixels to march");
    const auto found = reference::renderReference(*drawn_.volume, scene, 1);
    // The reference's error bound for one ray, or its tolerance.
    const double stated =
        isLit(scene) ? reference::Integrator::kToleranceLit : reference::Integrator::kTolerance;
    const double claimed = std::max(found.maximumRayError, stated * largest_) + 1e-7 * largest_;
    for (int k = 0; k < (scene.shadows ? 1 : 8); ++k) {
      const int pixel = draw.integer(0, pixels - 1);
      const Marched own = directMarch(drawn_.source, scene, pixel % scene.width, pixel / scene.width);
      for (int c = 0; c < 4; ++c) {
        const double value = double(found.image.pixels[std::size_t(pixel)][c]);
        const double off = std::abs(value - own.rgba[c]), allowed = claimed + own.error;
        if (off <= allowed) continue;
        // A surface may coincide with a clip plane, for example, where rounding decides whether it is met.
        Truth rounded = referenceOf(*drawn_.volume, scene, 1);
        addRounding(drawn_, scene, &rounded);
        if (off <= allowed + rounded.slack[std::size_t(pixel)][c]) continue;
        std::ostringstream text;
        text.precision(9);
        text << "pixel " << pixel << " component " << c << ": reference " << value << " claims "
             << found.maximumRayError << ", march " << own.rgba[c] << " within " << own.error;
        return report("reference", text.str());
      }
    }
  }

  /// Strata along a pixel's side with the box filter; each stratum has two rays.
  static constexpr int kQuickStrata = 6, kLongStrata = 32;
  const Truth& longTruth() {
    if (!long_) {
      long_ = referenceOf(*drawn_.volume, scene_, kLongStrata);
      if (scene_.filter == PixelFilter::point) addRounding(drawn_, scene_, &*long_);
    }
    return *long_;
  }

  /// Seeds and samples that cost about `fetches`.
  Effort effortFor(const Scene& scene, double fetches, int most) const {
    const int samples = int(std::clamp(fetches / costOf(drawn_.volume, scene), 32.0, double(most)));
    const int each = scene.sampling == Sampling::independent ? std::min(256, samples / 4) : 8;
    return {std::max(8, samples) / each, each};
  }

  /// A few standard errors, plus the effect of a few samples. Variances are not taken smaller than if each
  /// sample that hits anything showed the same.
  double quickNoise(const Estimates& found, const Truth& truth, std::size_t i, int c) const {
    const double mean = std::max(0.0, truth.mean[i][c]), alpha = std::max(truth.mean[i].a, 1e-12);
    const double ofHits = c < 3 ? mean * mean * (1 / alpha - 1) : alpha * (1 - alpha);
    const double variance = std::max(found.variance[i][c], ofHits / valueSamples_);
    return kQuickErrors * std::sqrt(variance / found.count) + 10 * mean / alpha / found.count / valueSamples_;
  }
  static constexpr double kQuickErrors = 4.5;

  double longNoise(const Estimates& found, double range, std::size_t i, int c) const {
    return empiricalBernstein(found.variance[i][c], range, found.count, kLogTerm);
  }

  void checkTracker(const Scene& scene) {
    const double rounding = 1e-6 * largest_;
    valueSamples_ = scene.sampling == Sampling::independent ? 1 : 8;
    const Estimates quick = estimate(drawn_.volume, scene, effortFor(scene, 1e6, 1 << 14), 1);
    const auto allowedQuick = [&](std::size_t i, int c) {
      return quickNoise(quick, quick_, i, c) + rounding;
    };
    if (!worstOf(quick, quick_, allowedQuick).beyond()) return;
    const Estimates more = estimate(drawn_.volume, scene, effortFor(scene, 4e7, 1 << 19), 1000);
    const Worst worst = worstOf(more, longTruth(), [&](std::size_t i, int c) {
      return longNoise(more, c < 3 ? largest_ : 1, i, c) + rounding;
    });
    if (worst.beyond()) report(std::string(nameOf(scene.method)), textOf(worst, more));
  }

  /// The parts that quadrature leaves out intentionally, and the rounding of its product of transmittances.
  double quadratureFloor(const Scene& scene, const Truth& truth, std::size_t i) const {
    constexpr double kOpaque = 1e-4;
    const double segments = drawn_.source.grid.diagonal() / (std::max(scene.step, 0.01) * smallestSpacing());
    const bool mayEnd = i + 1 == truth.mean.size() || truth.mean[i].a > 1 - 2 * kOpaque ||
                        scene.blend == BlendMode::composite || scene.filter == PixelFilter::box;
    return ((mayEnd ? kOpaque : 0) + (scene.shadows ? kOpaque : 0) + 2e-7 * (10 + segments)) * largest_;
  }
  double smallestSpacing() const {
    const glm::dvec3 spacing = drawn_.source.grid.spacing();
    return std::min({spacing.x, spacing.y, spacing.z});
  }

  /// Pictures at decreasing steps.
  struct Levels {
    std::vector<double> step;
    std::vector<Estimates> at;
    /// Bound on the error at the last step: twice the value for an error proportional to the step, by the
    /// largest slope found. Errors fall at least that fast, but unevenly.
    double bias(std::size_t i, int c) const {
      double slope = 0;
      for (std::size_t k = 1; k < at.size(); ++k)
        slope = std::max(slope, std::abs(at[k].mean[i][c] - at[k - 1].mean[i][c]) / (step[k - 1] - step[k]));
      return 2 * slope * step.back();
    }
  };
  Levels levelsOf(Scene scene, const std::vector<double>& steps, double fetches, int most,
                  std::uint32_t round) const {
    Levels levels;
    for (const double step : steps) {
      scene.step = std::clamp(step, 0.01, 100.0);
      if (!levels.step.empty() && scene.step == levels.step.back()) break;
      levels.step.push_back(scene.step);
      levels.at.push_back(estimate(drawn_.volume, scene, effortFor(scene, fetches, most), round));
    }
    return levels;
  }

  /// Allowed error at step 0, where no bound is known. An omission, or matter that is counted twice, causes
  /// far more.
  static constexpr double kWholeCells = 0.05;
  void checkWholeCells(const Scene& scene) {
    const Estimates found =
        estimate(drawn_.volume, scene, effortFor(scene, 1e6, isLit(scene) ? 1 << 14 : 512), 4);
    const Worst worst = worstOf(found, quick_, [&](std::size_t i, int c) {
      return longNoise(found, found.most[i][c] - found.least[i][c], i, c) +
             quadratureFloor(scene, quick_, i) + kWholeCells * (c < 3 ? largest_ : 1);
    });
    if (worst.beyond()) report(std::string(nameOf(scene.method)) + " of whole cells", textOf(worst, found));
  }

  void checkQuadrature(Scene scene) {
    valueSamples_ = scene.sampling == Sampling::independent ? 1 : 8;
    if (scene.step == 0) {
      checkWholeCells(scene);
      scene.step = 0.5;
    }
    const Levels quick =
        levelsOf(scene, {scene.step, scene.step / 4, scene.step / 16}, 1e5, isLit(scene) ? 1 << 12 : 512, 2);
    scene.step = quick.step.back();
    const Estimates& last = quick.at.back();
    const auto allowedQuick = [&](std::size_t i, int c) {
      return kQuickErrors * std::sqrt(last.variance[i][c] / last.count) + quick.bias(i, c) +
             quadratureFloor(scene, quick_, i);
    };
    if (!worstOf(last, quick_, allowedQuick).beyond()) return;
    const Levels more =
        levelsOf(scene, {0.16, 0.08, 0.04, 0.02, 0.01}, 2e7, isLit(scene) ? 1 << 17 : 1 << 13, 2000);
    scene.step = more.step.back();
    const Estimates& found = more.at.back();
    const auto allowed = [&](std::size_t i, int c) {
      // The observed range: values are all the same function of a few random numbers, and none of them is
      // rare.
      const double range = found.most[i][c] - found.least[i][c];
      return longNoise(found, range, i, c) + more.bias(i, c) + quadratureFloor(scene, longTruth(), i);
    };
    if (!worstOf(found, longTruth(), allowed).beyond()) return;
    const std::vector<double> hidden = hiddenFrom(scene);  // slow, and rarely needed
    const Worst worst = worstOf(found, longTruth(),
                                [&](std::size_t i, int c) { return allowed(i, c) + hidden[i] * largest_; });
    if (!worst.beyond()) return;
    // Absorption within a segment is ignored (docs/how-it-works.md). While a step may be opaque, errors do
    // not fall with the step yet, and differences between steps give no bound.
    if (depthOfStep(scene) > 1) return;
    std::ostringstream text;
    text << textOf(worst, found) << "; at steps";
    for (std::size_t k = 0; k < more.step.size(); ++k)
      text << " " << more.step[k] << ": " << more.at[k].mean[worst.pixel][worst.component];
    report(std::string(nameOf(scene.method)), text.str());
  }

  /// The largest optical depth that a segment can have.
  double depthOfStep(const Scene& scene) const {
    double extinction = 0;
    for (const ChannelAppearance& channel : scene.channels) {
      double opacity = 0;
      for (const OpacityKnot& knot : channel.opacity) opacity = std::max(opacity, knot.value);
      if (channel.visible) extinction += opacity * channel.density;
    }
    return extinction * scene.step * smallestSpacing();
  }

  /// For every pixel and the picture's mean: the opacity of features that lie between two samples. The field
  /// along a ray has a kink at each plane of voxels; steps that are too long never show such features there.
  std::vector<double> hiddenFrom(Scene scene) const {
    scene.shading = scene.shadows = false;  // matter is the same in any light
    std::vector<double> hidden;
    double sum = 0;
    const int pixels = scene.width * scene.height;
    for (int i = 0; i < pixels && scene.filter == PixelFilter::point; ++i) {
      const Marched marched = directMarch(drawn_.source, scene, i % scene.width, i / scene.width);
      hidden.push_back(-std::expm1(-marched.depthOfRunsBelow(scene.step * smallestSpacing())));
      sum += hidden.back();
    }
    if (hidden.empty()) return std::vector<double>(std::size_t(pixels) + 1, 0.0);
    hidden.push_back(sum / pixels);
    return hidden;
  }

  /// Pictures by `auto` of a number of seeds, and the RMS value of the errors that it claims.
  struct Claim {
    Choice choice;
    double estimated = 0;
    std::vector<Image> pictures;
  };
  Claim claimOf(Scene scene, int seeds, int samples) const {
    Claim claim;
    const std::atomic<bool> never = false;
    for (int k = 0; k < seeds; ++k) {
      scene.seed = std::uint32_t(3000 + k);
      const auto renderer = makeCpuRenderer(drawn_.volume, 1);
      renderer->setScene(scene);
      for (int i = 0; i < samples; ++i) renderer->renderSample(never);
      claim.pictures.push_back(renderer->image());
      claim.estimated += std::pow(renderer->estimatedError(), 2) / seeds;
      claim.choice = renderer->choice();
    }
    claim.estimated = std::sqrt(claim.estimated);
    return claim;
  }

  /// RMS over pictures, pixels and linear premultiplied RGBA, beyond the error that `hidden` may explain.
  double errorOf(const Claim& claim, const Truth& truth, const std::vector<double>& hidden) const {
    double squares = 0, count = 0;
    for (const Image& image : claim.pictures)
      for (std::size_t i = 0; i < image.pixels.size(); ++i)
        for (int c = 0; c < 4; ++c) {
          const double off = std::abs(double(image.pixels[i][c]) - truth.mean[i][c]) - truth.slack[i][c] -
                             hidden[i] * (c < 3 ? largest_ : 1) - 1e-6 * largest_;
          if (off > 0) squares += off * off;
          ++count;
        }
    return std::sqrt(squares / count);
  }

  /// `auto` promises that its picture converges, and that its estimated error is about the true one. Where
  /// pixels are few, rare events make both uncertain.
  void checkAutomatic(Scene scene) {
    const int side = scene.shadows ? 5 : 12, longer = std::max(scene.width, scene.height);
    scene.width = std::max(1, scene.width * side / longer);
    scene.height = std::max(1, scene.height * side / longer);
    scene.filter = PixelFilter::point;
    const Truth truth = referenceOf(*drawn_.volume, scene, 1);
    const std::vector<double> nothing(truth.mean.size(), 0.0);
    const auto isHonest = [&](const Claim& claim, const std::vector<double>& hidden) {
      return errorOf(claim, truth, hidden) <= 2 * claim.estimated + 1e-4;
    };
    if (isHonest(claimOf(scene, 4, 32), nothing)) return;
    const Claim claim = claimOf(scene, 16, 256);
    if (isHonest(claim, nothing)) return;
    scene.step = 1.0 / 64;
    const std::vector<double> hidden = hiddenFrom(scene);
    if (isHonest(claim, hidden)) return;
    std::ostringstream text;
    text << nameOf(claim.choice.method) << " at step " << claim.choice.step << " with "
         << claim.choice.corrections.size() << " levels is off by " << errorOf(claim, truth, hidden)
         << " (RMSE), and claims " << claim.estimated;
    report("auto", text.str());
  }

  const RandomScene& drawn_;
  Scene scene_;
  double largest_;
  double valueSamples_ = 1;
  Truth quick_;
  std::optional<Truth> long_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> checkScene(const RandomScene& scene) { return Checks(scene).all(); }

}  // namespace scolopax::random_scenes
