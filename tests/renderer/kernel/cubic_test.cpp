// SPDX-License-Identifier: Apache-2.0
// Scalars that are cubics on a segment: their turning points, where they meet a value, and the means of
// curves over them, against sums over many points in double.
#include "renderer/kernel/cubic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "renderer/data/transfer_function.h"
#include "renderer/kernel/segment_cubics.h"

namespace scolopax {
namespace {

using kernel::Cubic;
using kernel::One;

/// Random numbers of a fixed sequence.
struct RandomNumbers {
  std::mt19937 random{7};
  double between(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); }
};

struct DoubleCubic {
  double c0, c1, c2, c3;
  double at(double y) const { return c0 + y * (c1 + y * (c2 + y * c3)); }
};
DoubleCubic anyCubic(RandomNumbers& draw) {
  const auto coefficient = [&] { return draw.between(-1, 1) * draw.between(0, 1); };
  return {draw.between(-0.3, 1.3), coefficient(), coefficient(), coefficient()};
}
Cubic<One> sampled(const DoubleCubic& f, double scale = 1, double offset = 0) {
  float values[kernel::kCubicNodes];
  for (int i = 0; i < kernel::kCubicNodes; ++i)
    values[i] = float((f.at(double(kernel::cubicNode(i))) - offset) / scale);
  return kernel::cubicThrough<One>(values);
}

TEST(Cubic, GoesThroughItsNodesAndLiesWithinItsBounds) {
  RandomNumbers draw;
  for (int n = 0; n < 2000; ++n) {
    const DoubleCubic f = anyCubic(draw);
    const Cubic<One> found = sampled(f);
    const auto bounds = kernel::boundsOf(found);
    for (double y = -1; y <= 1; y += 0.125) {
      const double value = double(found.at(float(y)));
      ASSERT_NEAR(value, f.at(y), 1e-5);
      ASSERT_GE(value, double(bounds.lower) - 1e-5);
      ASSERT_LE(value, double(bounds.upper) + 1e-5);
    }
  }
}

TEST(Cubic, IsMonotoneBetweenItsTurns) {
  RandomNumbers draw;
  for (int n = 0; n < 2000; ++n) {
    const DoubleCubic f = anyCubic(draw);
    const Cubic<One> found = sampled(f);
    const auto turns = kernel::turnsOf(found);
    ASSERT_LE(turns.first, turns.second);
    const double ends[] = {-1, double(turns.first), double(turns.second), 1};
    for (int part = 0; part < 3; ++part) {
      const double a = ends[part], b = ends[part + 1];
      if (!(b - a > 1e-3)) continue;
      const bool rises = f.at(b) > f.at(a);
      for (int i = 0; i < 16; ++i) {
        const double step = f.at(a + (b - a) * (i + 1) / 16) - f.at(a + (b - a) * i / 16);
        ASSERT_GE(rises ? step : -step, -1e-5);
      }
    }
  }
}

TEST(Cubic, MeetsEveryValueBetweenItsTurns) {
  RandomNumbers draw;
  for (int n = 0; n < 5000; ++n) {
    const Cubic<One> f = sampled(anyCubic(draw));
    const auto turns = kernel::turnsOf(f);
    const float ends[] = {-1, turns.first, turns.second, 1};
    for (int part = 0; part < 3; ++part) {
      const float a = ends[part], b = ends[part + 1];
      if (!(a < b)) continue;
      const float value = f.at(a) + float(draw.between(0, 1)) * (f.at(b) - f.at(a));
      const float y = kernel::crossing<One>(f, a, b, f.at(a), f.at(b), value, true);
      ASSERT_GE(y, a);
      ASSERT_LE(y, b);
      ASSERT_NEAR(f.at(y), value, 2e-6f);
    }
  }
}

TEST(Cubic, TurnsAtTheSamePlacesAtAnyScale) {
  RandomNumbers draw;
  for (int n = 0; n < 200; ++n) {
    const DoubleCubic f = anyCubic(draw);
    const auto expected = kernel::turnsOf(sampled(f));
    for (const double scale : {1e-30, 1e-20, 1e15, 1e30}) {
      const auto found = kernel::turnsOf(sampled(f, 1 / scale));
      ASSERT_NEAR(found.first, expected.first, 2e-3) << scale;
      ASSERT_NEAR(found.second, expected.second, 2e-3) << scale;
    }
  }
}

/// A random appearance: a narrow peak, or knots and jumps anywhere.
ChannelAppearance anyPeakOrKnots(RandomNumbers& draw, bool narrow) {
  ChannelAppearance a;
  const double lo = draw.between(-2, 2), range = std::pow(10, draw.between(-2, 4));
  const bool falls = draw.between(0, 1) < 0.5;
  a.rangeLo = falls ? lo + range : lo;
  a.rangeHi = falls ? lo : lo + range;
  const double peak = draw.between(0.1, 0.9), width = std::pow(10, draw.between(-5, -2)) / 2;
  if (narrow) {
    a.opacity = {{0, 0}, {peak - width, 0}, {peak, 1}, {peak + width, 0}, {1, 0}};
  } else {
    a.opacity.clear();
    double p = 0;
    for (int k = 0; k < 5; ++k) {
      a.opacity.push_back({p, draw.between(0, 1)});
      if (draw.between(0, 1) > 0.2) p = std::min(1.0, p + draw.between(0, 0.4));  // else a jump
    }
  }
  a.color = {{0, {draw.between(0, 1), 0, 1}}, {draw.between(0, 1), {draw.between(0, 1), 1, 0}}};
  return a;
}

TEST(MeansOfCubic, AreThoseOfManyPoints) {
  RandomNumbers draw;
  for (int n = 0; n < 600; ++n) {
    const bool narrow = draw.between(0, 1) < 0.3;
    ChannelAppearance a = anyPeakOrKnots(draw, narrow);
    a.gamma = narrow || draw.between(0, 1) < 0.5 ? 1 : std::pow(2, draw.between(-1, 1));
    Channel channel;
    channel.slope = 1;
    const TransferFunction transfer(channel, a);
    const kernel::ChannelView view = transfer.view(channel);
    const DoubleCubic f = anyCubic(draw);
    const Cubic<One> places = sampled(f, std::abs(double(view.scale)), double(view.offset));
    const auto found = kernel::meansOfCubic<kernel::Detail::moment, One>(view, places, true);
    const int points = narrow ? 400'000 : 20'000;
    double opacity = 0, moment = 0, red = 0;
    for (int i = 0; i < points; ++i) {
      const double y = -1 + 2 * (i + 0.5) / points, p = std::pow(std::clamp(f.at(y), 0.0, 1.0), a.gamma);
      const double o = double(kernel::evaluate(view.opacity, float(p))) / points;
      opacity += o;
      moment += o * (y + 1) / 2;
      red += o * double(kernel::evaluate(view.color, float(p)).r);
    }
    // Extinction is linear in a cubic, the emission of degree 6, and the rule exact up to 5. With a gamma,
    // both are smooth on every piece, but no polynomials.
    ASSERT_NEAR(found.opacity, opacity, a.gamma == 1 ? 2e-4 : 1e-2) << n << " gamma " << a.gamma;
    ASSERT_NEAR(found.moment, moment, a.gamma == 1 ? 2e-4 : 1e-2) << n;
    ASSERT_NEAR(found.emission.r, red, a.gamma == 1 ? 3e-3 : 1e-2) << n;
  }
}

TEST(MeansOfCubic, OfAConstantAreTheCurvesValue) {
  // Also if the constant is exactly on a jump, where the value after the jump applies.
  Channel channel;
  channel.slope = 1;
  for (int top = 2; top < 256; ++top)
    for (int k = 1; k < top; k += 3) {
      ChannelAppearance a;
      a.rangeLo = 0;
      a.rangeHi = top;
      const double jump = double(k) / top;
      a.opacity = {{0, 0}, {jump, 0}, {jump, 1}, {1, 1}};
      const TransferFunction transfer(channel, a);
      const kernel::ChannelView view = transfer.view(channel);
      const float place = float(k) - view.origin;
      const float values[] = {place, place, place, place};
      const float found =
          kernel::meansOfCubic<kernel::Detail::extinction, One>(view, kernel::cubicThrough<One>(values), true)
              .opacity;
      ASSERT_NEAR(found, kernel::evaluate(view.opacity, kernel::curvePosition(view, float(k))), 1e-6)
          << k << " of " << top;
    }
}

}  // namespace
}  // namespace scolopax
