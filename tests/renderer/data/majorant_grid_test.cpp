// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "renderer/data/bound_columns.h"
#include "renderer/data/field_view.h"
#include "renderer/kernel/classify.h"
#include "renderer/kernel/filters.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

std::vector<OpacityKnot> randomCurve(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<OpacityKnot> knots;
  const int count = 1 + int(uniform(random) * 8);
  for (int i = 0; i < count; ++i)
    knots.push_back({uniform(random), uniform(random) < 0.4 ? 0 : uniform(random)});
  std::sort(knots.begin(), knots.end(), [](auto& a, auto& b) { return a.position < b.position; });
  if (uniform(random) < 0.5) {  // a box: two jumps
    const double a = uniform(random) * 0.5, b = a + uniform(random) * 0.01;
    knots = {{0, 0}, {a, 0}, {a, 1}, {b, 1}, {b, 0}, {1, 0}};
  } else if (uniform(random) < 0.5) {  // near-Dirac
    const double a = uniform(random) * 0.99;
    knots = {{0, 0}, {a, 0}, {a + 5e-6, 1}, {a + 1e-5, 0}, {1, 0}};
  }
  return knots;
}

/// The bounds of a single channel whose values are in the last column.
MajorantGrid majorantsOf(const std::shared_ptr<const MacrocellGrid>& cells,
                         const TransferFunction& transfer) {
  const int column = int(cells->levels.size()) - 1;
  return MajorantGrid(cells, {buildBounds(cells->levels.back(), transfer, column)}, true, false);
}
std::shared_ptr<const MacrocellGrid> macrocellsOf(const Volume& volume, int size) {
  return std::make_shared<const MacrocellGrid>(buildMacrocells(volume, size));
}

/// The same where the samples are those of the cubic B-spline.
std::shared_ptr<const MacrocellGrid> splineCellsOf(const Volume& volume, int size) {
  const auto column = std::make_shared<const CellColumn>(buildSplineColumn(volume, 0, size));
  return withColumns(macrocellsOf(volume, size), std::array{column});
}

/// Tests points that a tracker can fetch in a cell: corners, faces and the interior.
template <class T, class F>
void expectBound(F&& value, glm::ivec3 dims, double rangeLo, double rangeHi, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto volume = volumeOf(gridOf(dims), channelOf<T>(dims, value));
  const Channel& channel = volume->channels()[0];
  for (const int size : {1, 2, 3, 4, 7, 16}) {
    for (int trial = 0; trial < 12; ++trial) {
      const auto interpolation = Interpolation(trial / 3 % 3);
      const auto macrocells =
          interpolation == Interpolation::cubic ? splineCellsOf(*volume, size) : macrocellsOf(*volume, size);
      const MacrocellGrid& cells = *macrocells;
      ChannelAppearance a;
      a.opacity = randomCurve(random);
      a.rangeLo = rangeLo;
      a.rangeHi = rangeHi;
      a.gamma = trial % 3 == 2 ? 0.5 + 2 * double(uniform(random)) : 1;
      a.density = 3.7;
      const TransferFunction transfer(channel, a);
      const MajorantGrid majorants = majorantsOf(macrocells, transfer);
      const kernel::MajorantView bounds = majorants.view();
      const kernel::ChannelView view = transfer.view(channel);
      const kernel::FieldView field = fieldView(channel, interpolation);
      for (int sample = 0; sample < 4000; ++sample) {
        const glm::ivec3 cell(int(uniform(random) * float(cells.cells.x)),
                              int(uniform(random) * float(cells.cells.y)),
                              int(uniform(random) * float(cells.cells.z)));
        glm::vec3 p;
        for (int axis = 0; axis < 3; ++axis) {
          const float choice = uniform(random);  // often exactly on the cell's faces
          p[axis] = (float(cell[axis]) + (choice < 0.15f  ? 0
                                          : choice < 0.3f ? 1
                                                          : uniform(random))) *
                    float(size);
        }
        const float stored = kernel::sampleStored<kernel::One>(field, dims, p);
        const float sigma =
            kernel::isFinite(stored) ? kernel::extinctionAt(view, kernel::curvePosition(view, stored)) : 0.0f;
        const std::size_t index = (std::size_t(cell.z) * std::size_t(cells.cells.y) + std::size_t(cell.y)) *
                                      std::size_t(cells.cells.x) +
                                  std::size_t(cell.x);
        ASSERT_LE(sigma, bounds.total(index)) << "size " << size << " trial " << trial;
        ASSERT_LE(sigma, bounds.bound(index, 0))
            << "size " << size << " trial " << trial << " gamma " << a.gamma;
      }
    }
  }
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForBytes) {
  std::mt19937 random(1);
  expectBound<std::uint8_t>([&](int, int, int) { return random() % 256; }, {13, 9, 11}, 0, 255, 2);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForSignedWords) {
  std::mt19937 random(3);
  expectBound<std::int16_t>([&](int, int, int) { return int(random() % 65536) - 32768; }, {10, 7, 5}, -20000,
                            30000, 4);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForFloatsFarFromZero) {
  std::mt19937 random(5);
  expectBound<float>([&](int, int, int) { return 280.0 + double(random() % 1000) * 1e-4; }, {9, 8, 7}, 280,
                     280.1, 6);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForValuesThatAreNotFinite) {
  std::mt19937 random(7);
  expectBound<float>(
      [&](int, int, int) {
        switch (random() % 12) {
          case 0:
            return std::numeric_limits<float>::quiet_NaN();
          case 1:
            return std::numeric_limits<float>::infinity();
          case 2:
            return -std::numeric_limits<float>::infinity();
          case 3:
            return std::numeric_limits<float>::max();
          case 4:
            return -std::numeric_limits<float>::max();
          case 5:
            return 1e-40f;
          case 6:
            return -0.0f;
          default:
            return float(random() % 100) * 1e36f;
        }
      },
      {9, 8, 7}, -3e38, 3e38, 8);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForWordsOfManyValues) {
  std::mt19937 random(9);
  const auto value = [&](int, int, int) { return random() % 5 == 0 ? 0 : random() % 65536; };
  expectBound<std::uint16_t>(value, {17, 14, 15}, 1000, 60000, 10);
  expectBound<std::uint16_t>(value, {17, 14, 15}, 60000, 1000, 11);  // reversed
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForFloatsOfManyValuesAndScales) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> exponent(-44, 3);
  const auto value = [&](int, int, int) {  // denormals to thousands, either sign
    return (random() % 2 ? 1 : -1) * std::pow(10.0, exponent(random));
  };
  expectBound<float>(value, {15, 14, 13}, -1, 1, 13);
  expectBound<float>(value, {15, 14, 13}, 0, 1e-38, 14);
  expectBound<float>(value, {15, 14, 13}, 1e-3, 1e-3, 15);  // a step
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForConstantVolumesAndAStepAtTheirValue) {
  for (const float constant : {0.0f, -0.0f, 1.0f, -7.5f, 1e-40f}) {
    const auto value = [&](int, int, int) { return constant; };
    expectBound<float>(value, {5, 6, 7}, constant, constant, 16);
    expectBound<float>(value, {5, 6, 7}, double(constant) - 1, double(constant) + 1, 17);
  }
}

TEST(MajorantGrid, IsZeroExactlyWhereNoSampleOfTheCellHasExtinction) {
  // One bright voxel in the middle: only cells that its interpolation reaches may have a bound above zero.
  const glm::ivec3 dims(17);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) {
                                 return x == 8 && y == 8 && z == 8 ? 255 : 0;
                               }));
  ChannelAppearance a;
  a.rangeHi = 255;
  const auto cells = macrocellsOf(*volume, 4);
  EXPECT_EQ(cells->cells, glm::ivec3(4));
  const MajorantGrid majorants = majorantsOf(cells, TransferFunction(volume->channels()[0], a));
  int positive = 0;
  for (std::size_t cell = 0; cell < cells->cellCount(); ++cell) {
    const float bound = majorants.view().bound(cell, 0);
    positive += bound > 0;
    EXPECT_TRUE(bound == 0 || bound == 1);
    EXPECT_EQ(majorants.view().total(cell), bound);  // 0 and 1 need no rounding
  }
  EXPECT_EQ(positive, 8);  // voxel 8 is the corner of eight cells
}

TEST(MajorantGrid, TakesTheKnotsInsideAnIntervalAndBothSidesOfAJump) {
  const glm::ivec3 dims(2, 1, 1);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, [](int x, int, int) { return float(x); }));
  ChannelAppearance a;
  const auto majorantOf = [&](std::vector<OpacityKnot> opacity, ValueInterval interval) {
    a.opacity = std::move(opacity);
    return TransferFunction(volume->channels()[0], a).majorant(interval);
  };
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 1}, {1, 0}}, {0.25f, 0.75f}), 1.0f);
  EXPECT_EQ(majorantOf({{0, 1}, {1, 0}}, {0.25f, 0.75f}), 0.75f);  // a falling ramp
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0}, {0.5, 1}, {1, 0}}, {0.0f, 0.5f}), 1.0f);
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0.8}, {0.5, 0}, {1, 0}}, {0.25f, 0.5f}), 0.8f);
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0.8}, {0.5, 0}, {1, 0}}, {0.5f, 1.0f}), 0.0f);
  EXPECT_EQ(majorantOf({{0, 0}, {1, 1}}, {1.0f, 0.0f}), 0.0f);  // no finite sample
}

TEST(MajorantGrid, BoundsEveryIntervalOfLevelsByItsLeastUpperBound) {
  std::mt19937 random(18);
  std::uniform_real_distribution<double> uniform(0, 1);
  const glm::ivec3 dims(20);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, [&](int, int, int) { return uniform(random); }));
  ValueLevels levels = buildMacrocells(*volume, 2).levels[0];
  ASSERT_GT(levels.values.size(), 200u);
  for (const float slack : {0.0f, 1e-4f}) {
    levels.slack = slack;
    for (int trial = 0; trial < 8; ++trial) {
      ChannelAppearance a;
      a.opacity = randomCurve(random);
      a.gamma = trial % 2 ? 1 : 1.7;
      const TransferFunction transfer(volume->channels()[0], a);
      const kernel::BoundTable table = buildBounds(levels, transfer, 0);
      for (std::size_t lo = 0; lo < levels.values.size(); ++lo)
        for (std::size_t hi = lo; hi < levels.values.size(); ++hi) {
          const kernel::LevelInterval interval{std::uint8_t(lo), std::uint8_t(hi)};
          ASSERT_EQ(table.over(interval), transfer.majorant(levels.decode(interval))) << lo << " to " << hi;
        }
    }
  }
}

/// Three channels of different types in one volume.
std::shared_ptr<const Volume> threeChannels() {
  const glm::ivec3 dims(23, 18, 21);
  const auto wave = [](double phase) {
    return [phase](int x, int y, int z) {
      return 100 + 99 * std::sin(0.3 * x + phase) * std::cos(0.25 * y - phase) * std::sin(0.2 * z);
    };
  };
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, wave(0)),
                  channelOf<std::uint16_t>(dims, [&](int x, int y, int z) { return 300 * wave(1)(x, y, z); }),
                  channelOf<float>(dims, wave(2)));
}

TEST(MajorantGrid, IsAfterAnySeriesOfEditsWhatAFreshOneIs) {
  std::mt19937 random(19);
  const auto volume = threeChannels();
  const double largest[] = {255, 65535, 200};
  std::vector<ChannelAppearance> looks(3);
  std::vector<bool> visible(3, true);
  for (std::size_t i = 0; i < 3; ++i) looks[i].rangeHi = largest[i];
  auto macrocells = macrocellsOf(*volume, 3);
  std::optional<MajorantGrid> edited;
  bool sums = true, apart = false;
  for (int edit = 0; edit < 200; ++edit) {
    const std::size_t n = random() % 3;
    switch (random() % 8) {
      case 0:
        visible[n] = !visible[n];
        break;
      case 1:
        looks[n].density = double(random() % 3) * 0.75;
        break;
      case 2:
        (random() % 2 == 0 ? sums : apart) = random() % 2 == 0;
        break;
      case 3:
        if (random() % 3 == 0) macrocells = macrocellsOf(*volume, 1 + int(random() % 5));
        break;
      default:
        looks[n].opacity = randomCurve(random);
    }
    std::vector<kernel::BoundTable> tables;
    for (std::size_t i = 0; i < 3; ++i)
      if (visible[i])
        tables.push_back(
            buildBounds(macrocells->levels[i], TransferFunction(volume->channels()[i], looks[i]), int(i)));
    const MajorantGrid fresh(macrocells, tables, sums, apart);
    edited = MajorantGrid(macrocells, tables, sums, apart, edited ? &*edited : nullptr);
    EXPECT_EQ(fresh.cellsRebuilt(), macrocells->cellCount());
    const kernel::MajorantView a = edited->view(), b = fresh.view();
    ASSERT_EQ(a.active == nullptr, !apart);
    ASSERT_EQ(a.filledLow, b.filledLow) << "edit " << edit;
    ASSERT_EQ(a.filledHigh, b.filledHigh) << "edit " << edit;
    for (std::size_t cell = 0; cell < macrocells->cellCount(); ++cell) {
      ASSERT_EQ(a.totals[cell], b.totals[cell]) << "edit " << edit << " cell " << cell;
      if (apart) {
        ASSERT_EQ(a.active[cell], b.active[cell]) << "edit " << edit << " cell " << cell;
      }
      float sum = 0;
      for (int i = 0; i < int(tables.size()); ++i) {
        ASSERT_EQ(a.bound(cell, i), b.bound(cell, i));
        sum = sums ? sum + a.bound(cell, i) : std::max(sum, a.bound(cell, i));
      }
      ASSERT_GE(a.total(cell), sum);
      ASSERT_LE(a.total(cell), sum * (1 + 1.0f / 127));
    }
  }
}

TEST(MajorantGrid, WorksOutOnlyTheCellsWhoseValuesAnEditChanges) {
  const auto volume = threeChannels();
  const auto macrocells = macrocellsOf(*volume, 2);
  const auto curve = [](double bump) {
    return std::vector<OpacityKnot>{{0, 0}, {60 / 255.0, 0.1}, {65 / 255.0, bump}, {70 / 255.0, 0.1}, {1, 1}};
  };
  std::vector<ChannelAppearance> looks(3);
  for (auto& look : looks) {
    look.rangeHi = 255;
    look.opacity = curve(0.1);
  }
  std::optional<MajorantGrid> majorants;
  const auto update = [&] {
    std::vector<kernel::BoundTable> tables;
    for (std::size_t i = 0; i < 3; ++i)
      tables.push_back(
          buildBounds(macrocells->levels[i], TransferFunction(volume->channels()[i], looks[i]), int(i)));
    majorants = MajorantGrid(macrocells, tables, true, false, majorants ? &*majorants : nullptr);
    return majorants->cellsRebuilt();
  };
  EXPECT_EQ(update(), macrocells->cellCount());
  EXPECT_EQ(update(), 0u);
  looks[2].color = {{0, {1, 0, 0}}};
  EXPECT_EQ(update(), 0u);
  // Bytes are distinguished exactly: a bump over values 60 to 70 affects only cells that contain such values.
  // At its ends rounding decides.
  std::size_t least = 0, most = 0;
  for (std::size_t cell = 0; cell < macrocells->cellCount(); ++cell) {
    const ValueInterval v = macrocells->interval(cell, 0);
    least += v.hi > 60.5f && v.lo < 69.5f;
    most += v.hi > 59.5f && v.lo < 70.5f;
  }
  ASSERT_GT(least, 0u);
  ASSERT_LT(most, macrocells->cellCount() / 3);
  for (const double bump : {0.9, 0.2, 0.1}) {
    looks[0].opacity = curve(bump);
    const std::size_t touched = update();
    EXPECT_GE(touched, least);
    EXPECT_LE(touched, most);
  }
}

TEST(MajorantGrid, LeavesTheOneBeforeAsItWasAndSharesWhatIsNotNew) {
  const auto volume = threeChannels();
  const auto macrocells = macrocellsOf(*volume, 2);
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(64) << 20);
  ChannelAppearance look;
  look.rangeHi = 255;
  const auto tables = [&] {
    return std::vector<kernel::BoundTable>{
        buildBounds(macrocells->levels[0], TransferFunction(volume->channels()[0], look), 0)};
  };
  const MajorantGrid first(macrocells, tables(), true, false, nullptr, memory);
  const std::uint64_t bytes = memory->used(MemoryUse::grids);
  EXPECT_GT(bytes, macrocells->cellCount());
  const std::vector<kernel::TotalCode> then(first.view().totals,
                                            first.view().totals + macrocells->cellCount());
  const MajorantGrid same(macrocells, tables(), true, false, &first, memory);
  EXPECT_EQ(same.view().totals, first.view().totals);
  EXPECT_EQ(memory->used(MemoryUse::grids), bytes);
  {
    look.opacity = {{0, 0}, {0.5, 0}, {1, 1}};
    const MajorantGrid edited(macrocells, tables(), true, false, &same, memory);
    EXPECT_GT(edited.cellsRebuilt(), 0u);
    EXPECT_EQ(memory->used(MemoryUse::grids), 2 * bytes);
    EXPECT_FALSE(std::equal(then.begin(), then.end(), edited.view().totals));
  }
  EXPECT_TRUE(std::equal(then.begin(), then.end(), first.view().totals));
  EXPECT_EQ(memory->used(MemoryUse::grids), bytes);
}

TEST(MajorantGrid, KnowsHowFarAroundABlockNothingIsAndWhichBoxHasEverything) {
  // A few bright voxels; the outer blocks are incomplete at the far sides.
  std::mt19937 random(20);
  const glm::ivec3 dims(42, 10, 14);
  for (const int bright : {0, 1, 2, 12}) {
    std::vector<glm::ivec3> places;
    for (int i = 0; i < bright; ++i)
      places.push_back({int(random() % 42), int(random() % 10), int(random() % 14)});
    const auto volume = volumeOf(
        gridOf(dims), channelOf<std::uint8_t>(dims, [&](int x, int y, int z) {
          return std::find(places.begin(), places.end(), glm::ivec3(x, y, z)) == places.end() ? 0 : 9;
        }));
    ChannelAppearance a;
    a.rangeHi = 255;
    const auto cells = macrocellsOf(*volume, 1);
    const MajorantGrid majorants = majorantsOf(cells, TransferFunction(volume->channels()[0], a));
    const kernel::MajorantView view = majorants.view();
    const glm::ivec3 n = cells->cells;
    const auto blockOf = [&](int cell) {
      return glm::ivec3(cell % n.x, cell / n.x % n.y, cell / n.x / n.y) / 4;
    };
    std::vector<int> filled;
    glm::ivec3 low = (n + 3) / 4, high(0);  // blocks
    for (int cell = 0; cell < int(cells->cellCount()); ++cell) {
      if (!(view.bound(std::size_t(cell), 0) > 0)) continue;
      filled.push_back(cell);
      low = glm::min(low, blockOf(cell));
      high = glm::max(high, blockOf(cell) + 1);
    }
    EXPECT_EQ(view.filledLow, low * 4);
    EXPECT_EQ(view.filledHigh, glm::min(high * 4, n));
    for (int cell = 0; cell < int(cells->cellCount()); ++cell) {
      int nearest = 8;
      for (const int other : filled) {
        const glm::ivec3 away = blockOf(cell) - blockOf(other);
        nearest = std::min(nearest, std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)}));
      }
      ASSERT_EQ(view.emptyRadius(std::size_t(cell)), nearest) << cell;
    }
  }
}

}  // namespace
}  // namespace scolopax
