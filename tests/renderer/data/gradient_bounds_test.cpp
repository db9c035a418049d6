// SPDX-License-Identifier: Apache-2.0
// Bounds of the extinction where opacity depends on the gradient: searches for samples above them, and checks
// that they are 0 where the field is flat.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "renderer/data/render_plan.h"
#include "renderer/kernel/blend_modes.h"
#include "tests/support/gradients.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

/// The random inputs of the search.
struct RandomInputs {
  std::mt19937 random;
  explicit RandomInputs(unsigned seed) : random(seed) {}
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  double between(double lo, double hi) { return lo + (hi - lo) * unit(); }
  int among(int lo, int hi) { return lo + int(random() % unsigned(hi - lo + 1)); }
  bool chance(double p) { return unit() < p; }

  /// Down to one voxel along an axis; orthogonal or not, isotropic or not, at any scale.
  Grid grid() {
    glm::ivec3 dims;
    for (int axis = 0; axis < 3; ++axis) dims[axis] = chance(0.3) ? among(1, 3) : among(4, 11);
    glm::dvec3 spacing(1);
    if (chance(0.5)) spacing = {between(0.3, 3), between(0.3, 3), between(0.3, 3)};
    if (chance(0.1)) spacing.z *= 100;
    Grid made = gridOf(dims, spacing * (chance(0.2) ? std::pow(10, between(-6, 6)) : 1.0));
    if (chance(0.4)) {
      const glm::dmat4 tilt(glm::dvec4(0.8, 0.6, 0, 0), glm::dvec4(-0.6, 0.8, 0, 0),
                            glm::dvec4(between(-0.5, 0.5), between(-0.5, 0.5), 1, 0), glm::dvec4(0, 0, 0, 1));
      made.worldFromVoxel = tilt * made.worldFromVoxel;
    }
    return made;
  }

  /// Knots anywhere, jumps, spikes and constants.
  std::vector<OpacityKnot> curve() {
    std::vector<OpacityKnot> knots;
    for (int i = among(1, 6); i > 0; --i) knots.push_back({unit(), chance(0.4) ? among(0, 1) : unit()});
    std::sort(knots.begin(), knots.end(),
              [](const OpacityKnot& a, const OpacityKnot& b) { return a.position < b.position; });
    if (knots.size() > 2 && chance(0.5)) knots[1].position = knots[2].position;
    if (chance(0.2)) {
      const double at = unit() * 0.99;
      knots = {{at, 0}, {at + 5e-6, 1}, {at + 1e-5, 0}};
    }
    return knots;
  }

  /// A range between gradients of the data, exact to the last bit: there rounding decides a sample's value.
  GradientOpacity opacity(const std::vector<double>& magnitudes) {
    const auto one = [&] {
      if (magnitudes.empty()) return unit();
      const double at = chance(0.3) ? magnitudes.back() : magnitudes[random() % magnitudes.size()];
      return chance(0.5) ? at : at * between(0.5, 1.5);
    };
    GradientOpacity made{chance(0.5) ? 0 : one(), one(), curve()};
    if (chance(0.2)) made.rangeLo = made.rangeHi;
    if (chance(0.1)) made.rangeLo = made.rangeHi * (1 - std::pow(10, between(-7, -1)));
    if (chance(0.2)) std::swap(made.rangeLo, made.rangeHi);
    return made;
  }
};

/// A coordinate in a macrocell that begins at voxel `low`: anywhere, or where something changes, exact to the
/// last bit. The outermost cells extend half a voxel beyond the outer voxels' centres.
float coordinateIn(RandomInputs& draw, int low, int size, int count) {
  const float begin = low == 0 ? -0.5f : float(low),
              end = low + size >= count - 1 ? float(count) - 0.5f : float(low + size);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  float at = begin + float(draw.unit()) * (end - begin);
  switch (draw.among(0, 4)) {
    case 0:
      at = std::round(at);  // a voxel's centre
      break;
    case 1:
      at = std::nextafter(std::round(at), draw.chance(0.5) ? -infinity : infinity);
      break;
    case 2:
      at = draw.chance(0.5) ? begin : end;
      break;
    default:
      break;
  }
  return std::clamp(at, begin, end);
}

/// Searches all macrocells of a plan up to the first violation; returns how many samples had extinction.
int expectPlanBounds(RandomInputs& draw, const RenderPlan& plan, int samplesPerCell) {
  const kernel::SceneView& view = plan.view();
  const glm::ivec3 cells = view.majorants.cells;
  const int size = int(view.majorants.cellSize);
  int seen = 0;
  for (int cell = 0; cell < cells.x * cells.y * cells.z; ++cell) {
    const glm::ivec3 low =
        size * glm::ivec3(cell % cells.x, cell / cells.x % cells.y, cell / (cells.x * cells.y));
    for (int sample = 0; sample < samplesPerCell; ++sample) {
      glm::vec3 point;
      for (int axis = 0; axis < 3; ++axis) point[axis] = coordinateIn(draw, low[axis], size, view.dims[axis]);
      kernel::SampleCost cost;
      float sum = 0;
      bool holds = true;
      for (int n = 0; n < view.channelCount; ++n) {
        const float extinction = kernel::classify(view, n, point, &cost).extinction;
        holds = holds && extinction <= view.majorants.bound(std::size_t(cell), n);
        sum += extinction;
      }
      if (!holds || !(sum <= view.majorants.total(std::size_t(cell)))) {
        ADD_FAILURE() << std::hexfloat << "at " << point.x << ' ' << point.y << ' ' << point.z << ": " << sum
                      << " above " << view.majorants.total(std::size_t(cell));
        return seen;
      }
      seen += sum > 0;
    }
  }
  return seen;
}

/// A volume with one kind of values: noise, few values, ramps, constants with a spike, or large values with
/// small differences; floats include some that are not finite.
template <class T>
ChannelSource drawChannel(RandomInputs& draw, glm::ivec3 dims) {
  constexpr double kMost = std::is_integral_v<T> ? double(std::numeric_limits<T>::max()) : 1000.0;
  constexpr double kLeast = std::is_signed_v<T> ? -kMost : 0.0;
  const int kind = draw.among(0, 4);
  const double scale = std::is_integral_v<T> || draw.chance(0.6) ? 1 : std::pow(10, draw.between(-30, 30));
  const bool far = !std::is_integral_v<T> && draw.chance(0.3);
  const double holes = !std::is_integral_v<T> && draw.chance(0.3) ? 0.05 : 0;
  const glm::dvec3 slope(draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1));
  ChannelSource channel = channelOf<T>(dims, [&](int x, int y, int z) -> double {
    if (draw.chance(holes))
      return draw.chance(0.7) ? std::numeric_limits<double>::quiet_NaN()
                              : std::numeric_limits<double>::infinity();
    double value = draw.between(kLeast, kMost);
    if (kind == 1) value = draw.among(0, 2) * kMost / 2;
    if (kind == 2) {
      const glm::dvec3 share = glm::dvec3(x, y, z) / glm::dvec3(dims);
      value = kMost *
              std::clamp(0.5 + 0.3 * (slope.x * share.x + slope.y * share.y + slope.z * share.z), 0.0, 1.0);
    }
    if (kind == 3) value = x == dims.x / 2 && y == dims.y / 2 && z == dims.z / 2 ? kMost : kMost / 3;
    return scale * (far ? 1e6 + draw.among(0, 8) : value);
  });
  if (draw.chance(0.5)) channel.slope = draw.between(-2, 2), channel.intercept = draw.between(-100, 100);
  return channel;
}

template <class T>
void searchForViolations(unsigned seed) {
  RandomInputs draw(seed);
  int seen = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Grid grid = draw.grid();
    std::vector<ChannelSource> sources;
    for (int n = draw.among(1, 2); n > 0; --n) sources.push_back(drawChannel<T>(draw, grid.dims));
    const auto volume = std::make_shared<const Volume>(grid, std::move(sources));
    std::shared_ptr<const RenderPlan> plan;
    for (int look = 0; look < 6; ++look) {
      Scene scene = frontScene(*volume, 1, 1);
      constexpr int kSizes[] = {1, 2, 3, 4, 7, 16};
      scene.macrocell = kSizes[draw.among(0, 5)];
      for (std::size_t n = 0; n < scene.channels.size(); ++n) {
        const Histogram& values = volume->channels()[n].histogram;
        ChannelAppearance& a = scene.channels[n];
        a.rangeLo = values.minimum;
        a.rangeHi = values.maximum;
        a.opacity = draw.chance(0.5) ? std::vector<OpacityKnot>{{0, 1}} : draw.curve();
        a.density = std::pow(10, draw.between(-2, 6));
        a.gamma = draw.chance(0.2) ? 1.7 : 1;
        a.interpolation = Interpolation(std::max(0, draw.among(-1, 2)));
        if (n == 0 || draw.chance(0.5))
          a.gradientOpacity = draw.opacity(gradientMagnitudes(grid, volume->channels()[n]));
      }
      SCOPED_TRACE(testing::Message() << "trial " << trial << " look " << look << " size " << scene.macrocell
                                      << " dims " << grid.dims.x << ' ' << grid.dims.y << ' ' << grid.dims.z);
      plan = std::make_shared<const RenderPlan>(volume, scene, plan.get());
      const glm::ivec3 cells = plan->view().majorants.cells;
      seen += expectPlanBounds(draw, *plan, 100 + 4000 / (cells.x * cells.y * cells.z));
      if (testing::Test::HasFailure()) return;
    }
  }
  EXPECT_GT(seen, 100000);  // otherwise the search tested too few samples
}

TEST(GradientBounds, AreNeverBelowTheClassifiedValueForBytes) { searchForViolations<std::uint8_t>(1); }
TEST(GradientBounds, AreNeverBelowTheClassifiedValueForSignedWords) { searchForViolations<std::int16_t>(2); }
TEST(GradientBounds, AreNeverBelowTheClassifiedValueForWords) { searchForViolations<std::uint16_t>(3); }
TEST(GradientBounds, AreNeverBelowTheClassifiedValueForFloats) {
  searchForViolations<float>(4);
  searchForViolations<float>(5);
}

/// A block of one value inside another value, with macrocells of four voxels. Macrocells in the interior of
/// either are flat, whatever the offset and scale.
template <class T>
std::shared_ptr<const Volume> nestedBlocks() {
  const glm::ivec3 dims(33);
  return volumeOf(gridOf(dims, {1, 0.5, 2}), channelOf<T>(
                                                 dims,
                                                 [](int x, int y, int z) {
                                                   const auto inside = [](int i) {
                                                     return i >= 10 && i <= 24;
                                                   };
                                                   return inside(x) && inside(y) && inside(z) ? 77 : 33;
                                                 },
                                                 0.3, 11));
}

template <class T>
void expectNothingWhereNothingIsSteep() {
  const auto volume = nestedBlocks<T>();
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0] = solid(5);
  scene.channels[0].gradientOpacity = GradientOpacity{1, 10, {{0, 0}, {1, 1}}};
  const RenderPlan plan(volume, scene);
  const kernel::MajorantView bounds = plan.view().majorants;
  ASSERT_EQ(bounds.cells, glm::ivec3(8));
  std::size_t cell = 0;
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x, ++cell) {
        // Voxels whose differences cross the block's faces: 9, 10, 24 and 25.
        const auto outside = [](int i) { return i <= 1 || i == 7; };  // up to voxel 8, from voxel 28 on
        const auto inside = [](int i) { return i == 3 || i == 4; };   // from voxel 12 to voxel 20
        const auto at = [](int i) { return i == 2 || i == 6; };       // 8 to 12 and 24 to 28
        if (outside(x) || outside(y) || outside(z) || (inside(x) && inside(y) && inside(z))) {
          EXPECT_EQ(bounds.bound(cell, 0), 0) << x << ' ' << y << ' ' << z;
          EXPECT_EQ(bounds.total(cell), 0) << x << ' ' << y << ' ' << z;
        } else if ((at(x) && inside(y) && inside(z)) || (inside(x) && inside(y) && at(z))) {
          EXPECT_GT(bounds.bound(cell, 0), 0) << x << ' ' << y << ' ' << z;
        }
      }
}

TEST(GradientBounds, AreZeroWhereNothingIsSteep) {
  expectNothingWhereNothingIsSteep<std::uint8_t>();
  expectNothingWhereNothingIsSteep<std::int16_t>();
  expectNothingWhereNothingIsSteep<float>();
}

TEST(GradientBounds, AreTightWhereTheGradientIsOne) {
  // A ramp: the factor is the same in every cell, and bounds exceed it only by rounding.
  const glm::ivec3 dims(17);
  const auto volume = volumeOf(gridOf(dims, {1, 2, 0.5}),
                               channelOf<std::uint8_t>(dims, [](int x, int, int) { return 10 * x; }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0] = solid(1);
  scene.channels[0].gradientOpacity = GradientOpacity{0, 40, {{0, 0}, {1, 1}}};  // a quarter
  const RenderPlan plan(volume, scene);
  const kernel::MajorantView bounds = plan.view().majorants;
  for (std::size_t cell = 0; cell < 64; ++cell) {
    EXPECT_GE(bounds.bound(cell, 0), 0.25f * (1 - 1e-5f));
    EXPECT_LE(bounds.bound(cell, 0), 0.25f * 1.01f);  // differences of bytes are known much more accurately
  }
}

TEST(GradientBounds, AreAfterAnySeriesOfEditsWhatAFreshPlanHas) {
  RandomInputs draw(6);
  const glm::ivec3 dims(14, 11, 12);
  const auto wave = [](double phase) {
    return [phase](int x, int y, int z) {
      return 100 + 99 * std::sin(0.7 * x + phase) * std::cos(0.5 * y - phase) * std::sin(0.6 * z);
    };
  };
  const auto volume = volumeOf(gridOf(dims, {1, 2, 0.7}), channelOf<std::uint8_t>(dims, wave(0)),
                               channelOf<float>(dims, wave(1)), channelOf<std::int16_t>(dims, wave(2), -3));
  Scene scene = frontScene(*volume, 1, 1);
  for (ChannelAppearance& a : scene.channels) a.rangeLo = -600, a.rangeHi = 200;
  std::shared_ptr<const RenderPlan> edited;
  int changed = 0;
  std::vector<float> before;
  for (int edit = 0; edit < 120; ++edit) {
    const std::size_t n = std::size_t(draw.among(0, 2));
    ChannelAppearance& a = scene.channels[n];
    const int kind = draw.among(0, 10);
    if (kind == 0) a.visible = !a.visible;
    if (kind == 1) a.opacity = draw.curve();
    if (kind == 2) scene.macrocell = draw.among(1, 5);
    if (kind == 3) scene.blend = scene.blend == BlendMode::density ? BlendMode::max : BlendMode::density;
    if (kind == 4) a.gradientOpacity.reset();
    if (kind == 10) a.interpolation = Interpolation(draw.among(0, 2));
    if (kind >= 5 && kind <= 9)
      a.gradientOpacity = draw.opacity(gradientMagnitudes(volume->grid(), volume->channels()[n]));
    edited = std::make_shared<const RenderPlan>(volume, scene, edited.get());
    const RenderPlan fresh(volume, scene);
    const kernel::MajorantView found = edited->view().majorants, expected = fresh.view().majorants;
    ASSERT_EQ(edited->view().channelCount, fresh.view().channelCount) << edit;
    ASSERT_EQ(found.cells, expected.cells);
    ASSERT_EQ(found.filledLow, expected.filledLow) << edit;
    ASSERT_EQ(found.filledHigh, expected.filledHigh) << edit;
    std::vector<float> now;
    const std::size_t cells = std::size_t(found.cells.x * found.cells.y * found.cells.z);
    for (std::size_t cell = 0; cell < cells; ++cell) {
      now.push_back(found.total(cell));
      ASSERT_EQ(found.total(cell), expected.total(cell)) << "edit " << edit << " cell " << cell;
      ASSERT_EQ(found.emptyRadius(cell), expected.emptyRadius(cell)) << "edit " << edit << " cell " << cell;
      for (int i = 0; i < edited->view().channelCount; ++i)
        ASSERT_EQ(found.bound(cell, i), expected.bound(cell, i)) << "edit " << edit << " cell " << cell;
    }
    changed += kind >= 5 && kind <= 9 && now != before;
    before = std::move(now);
  }
  EXPECT_GT(changed, 10);  // by edits of the factor only
}

}  // namespace
}  // namespace scolopax
