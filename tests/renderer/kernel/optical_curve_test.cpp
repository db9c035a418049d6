// SPDX-License-Identifier: Apache-2.0
#include "renderer/kernel/optical_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "renderer/data/curve.h"
#include "renderer/data/transfer_function.h"

namespace scolopax {
namespace {

/// Opacity and colour by their definition, in double: positions are clamped to [0,1]; of two knots at one
/// position the later counts.
struct Curves {
  std::vector<OpacityKnot> opacity;
  std::vector<ColorKnot> color;

  template <class Knot, class Get>
  static auto at(const std::vector<Knot>& knots, double p, Get&& get) {
    p = std::clamp(p, 0.0, 1.0);
    const auto next = std::upper_bound(knots.begin(), knots.end(), p, [](double position, const Knot& knot) {
      return position < knot.position;
    });
    if (next == knots.begin()) return get(knots.front());
    if (next == knots.end()) return get(knots.back());
    const Knot &a = *std::prev(next), &b = *next;
    return get(a) + (p - a.position) / (b.position - a.position) * (get(b) - get(a));
  }
  double opacityAt(double p) const {
    return at(opacity, p, [](const OpacityKnot& k) { return k.value; });
  }
  glm::dvec3 colorAt(double p) const {
    return at(color, p, [](const ColorKnot& k) { return k.color; });
  }
};

/// Means from p to q by Simpson's rule between all knots: exact for products of two lines.
struct Means {
  double opacity = 0, moment = 0;
  glm::dvec3 emission{0};
};
Means meansOf(const Curves& curves, double p, double q) {
  std::vector<double> cuts{p, q};
  for (const double end : {0.0, 1.0})
    if ((end - p) * (end - q) < 0) cuts.push_back(end);
  for (const auto& k : curves.opacity)
    if ((k.position - p) * (k.position - q) < 0) cuts.push_back(k.position);
  for (const auto& k : curves.color)
    if ((k.position - p) * (k.position - q) < 0) cuts.push_back(k.position);
  std::sort(cuts.begin(), cuts.end());
  if (p > q) std::reverse(cuts.begin(), cuts.end());
  Means means;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double a = cuts[i], b = cuts[i + 1], width = (b - a) / (q - p);
    if (!(width > 0)) continue;
    // The ends are slightly inside, away from jumps; for a line this makes no difference.
    for (const double t : {1e-7, 0.5, 1 - 1e-7}) {
      const double at = a + t * (b - a), weight = width * (t == 0.5 ? 4 : 1) / 6;
      const double opacity = curves.opacityAt(at);
      means.opacity += weight * opacity;
      means.emission += weight * opacity * curves.colorAt(at);
      means.moment += weight * opacity * ((at - p) / (q - p));
    }
  }
  return means;
}

Curves randomCurves(std::mt19937& random, int knots) {
  const auto number = [&] { return double(random() % 1001) / 1000; };
  Curves curves;
  std::vector<double> positions;
  for (int i = 0; i < knots; ++i) positions.push_back(random() % 3 ? number() : std::round(number() * 4) / 4);
  std::sort(positions.begin(), positions.end());
  for (const double p : positions) {
    curves.opacity.push_back({double(float(p)), random() % 3 ? number() : 0});
    curves.color.push_back(
        {double(float(std::min(1.0, p + (random() % 2 ? 0 : 1e-3)))), {number(), number(), number()}});
  }
  std::sort(curves.color.begin(), curves.color.end(),
            [](const ColorKnot& a, const ColorKnot& b) { return a.position < b.position; });
  return curves;
}

struct Made {
  std::unique_ptr<TransferFunction> owner;
  kernel::OpticalCurveView view;
};
Made made(const Curves& curves) {
  ChannelAppearance appearance;
  appearance.opacity = curves.opacity;
  appearance.color = curves.color;
  Channel channel;
  Made result{std::make_unique<TransferFunction>(channel, appearance), {}};
  result.view = result.owner->view(channel).optical;
  return result;
}

kernel::PartOf<kernel::One> meansBetween(const kernel::OpticalCurveView& curve, float p, float q) {
  return kernel::meansBetween<kernel::Detail::moment, kernel::One>(
      curve, kernel::pointOn<kernel::One>(curve, p), kernel::pointOn<kernel::One>(curve, q), true);
}

TEST(OpticalCurve, HasTheMeansOfBothCurvesOverAnyStretch) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    const Curves curves = randomCurves(random, 1 + round % 9);
    const Made curve = made(curves);
    for (int i = 0; i < 40; ++i) {
      const auto place = [&] {
        const double p = double(random() % 10001) / 10000;
        return random() % 5 ? p : 3 * p - 1;  // also outside, where the curves are constant
      };
      const float p = float(place()), q = float(place());
      if (p == q) continue;
      const kernel::PartOf<kernel::One> found = meansBetween(curve.view, p, q);
      const Means expected = meansOf(curves, p, q);
      ASSERT_NEAR(double(found.opacity), expected.opacity, 2e-5) << p << " to " << q;
      ASSERT_NEAR(double(found.moment), expected.moment, 2e-5) << p << " to " << q;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(double(found.emission[c]), expected.emission[c], 2e-5) << p << " to " << q;
    }
  }
}

TEST(OpticalCurve, FindsPiecesAmongAllKnotsInOneBucket) {
  // 4000 knots within 1/8 of a bucket, of a sawtooth, and with jumps.
  Curves curves;
  for (int i = 0; i < 4000; ++i) {
    const double p = double(float(0.5 + 0.0005 * (i / 2) / 2000));
    curves.opacity.push_back({p, i % 4 == 0 ? 1.0 : 0.25 * (i % 4)});
  }
  curves.color = {{0, glm::dvec3(1)}};
  const Made curve = made(curves);
  Curve<float> plain = makeCurve(curves.opacity, "opacity");
  std::mt19937 random(9);
  for (int i = 0; i < 4000; ++i) {
    const float p = i % 3 == 0   ? float(curves.opacity[random() % 4000].position)
                    : i % 3 == 1 ? float(random() % 1001) / 1000
                                 : 0.5f + 0.0005f * float(random() % 1001) / 1000;
    int expected = -1;
    for (int k = 0; k < curve.view.count && curve.view.knots[k].position <= p; ++k) expected = k;
    ASSERT_EQ(kernel::pointOn<kernel::One>(curve.view, p).piece, p < 1 ? expected : curve.view.count - 1)
        << p;
    const auto next = std::upper_bound(plain.positions.begin(), plain.positions.end(), p);
    ASSERT_EQ(kernel::knotBefore(plain.view(), p), int(next - plain.positions.begin()) - 1) << p;
  }
}

TEST(OpticalCurve, AtOnePositionIsBothCurves) {
  std::mt19937 random(8);
  for (int round = 0; round < 200; ++round) {
    const Curves curves = randomCurves(random, 1 + round % 9);
    const Made curve = made(curves);
    for (int i = 0; i < 40; ++i) {
      const float p = i % 2 ? float(random() % 1001) / 1000
                            : float(curves.opacity[i / 2 % curves.opacity.size()].position);
      const kernel::PartOf<kernel::One> found = meansBetween(curve.view, p, p);
      ASSERT_NEAR(double(found.opacity), curves.opacityAt(p), 1e-5) << p;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(double(found.emission[c]), curves.opacityAt(p) * curves.colorAt(p)[c], 1e-5) << p;
    }
  }
}

TEST(OpticalCurve, KnowsWhereItsOpacityBeginsAndEnds) {
  std::mt19937 random(9);
  int somewhere = 0;
  for (int round = 0; round < 300; ++round) {
    Curves curves = randomCurves(random, 2 + round % 7);
    curves.opacity.front().value = curves.opacity.back().value = 0;
    const Made curve = made(curves);
    for (int i = 0; i <= 1000; ++i) {
      const float p = float(i) / 1000;
      const float opacity = kernel::opticalAt<kernel::Detail::extinction, kernel::One>(
                                curve.view, kernel::pointOn<kernel::One>(curve.view, p), true)
                                .opacity;
      if (p <= curve.view.first || p >= curve.view.last)
        ASSERT_EQ(opacity, 0.0f) << p;
      else
        ++somewhere;
    }
  }
  EXPECT_GT(somewhere, 50000);
}

TEST(OpticalCurve, OfNoVoxelThatIsANumberHasNoPosition) {
  kernel::ChannelView channel{};
  channel.scale = 1;
  channel.gamma = 1;
  for (const float stored : {__builtin_nanf(""), __builtin_huge_valf(), -__builtin_huge_valf()})
    EXPECT_NE(kernel::stretchPosition(channel, stored), kernel::stretchPosition(channel, stored));
  EXPECT_EQ(kernel::stretchPosition(channel, 1.5f), 1.5f);
}

}  // namespace
}  // namespace scolopax
