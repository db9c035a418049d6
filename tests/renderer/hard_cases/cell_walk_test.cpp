// SPDX-License-Identifier: Apache-2.0
// Rays that traversals often get wrong: along faces and edges, with zero components, and with invalid
// numbers.
#include "renderer/kernel/cell_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <random>
#include <vector>

namespace scolopax::kernel {
namespace {

/// Clips the ray to the box [-1/2, dims - 1/2].
kernel::Interval clipToVolume(const kernel::Ray& ray, glm::ivec3 dims) {
  return kernel::clipToBox(ray, glm::vec3(-0.5f), glm::vec3(dims) - 0.5f);
}

constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
constexpr float kLargest = std::numeric_limits<float>::max();

/// A grid of macrocells without values, because walks read none.
MajorantView gridFor(glm::ivec3 dims, int size) {
  MajorantView grid{};
  grid.cells = glm::max(glm::ivec3(1), (dims - 2 + size) / size);
  grid.cellSize = float(size);
  return grid;
}
int longestWalk(const MajorantView& grid) { return grid.cells.x + grid.cells.y + grid.cells.z - 2; }
std::size_t cellCount(const MajorantView& grid) {
  return std::size_t(grid.cells.x) * std::size_t(grid.cells.y) * std::size_t(grid.cells.z);
}

/// The same in double, for finite rays.
Interval clipInDouble(const Ray& ray, glm::ivec3 dims) {
  double enter = 0, exit = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = double(ray.origin[axis]), d = double(ray.direction[axis]);
    if (d == 0) {
      if (o < -0.5 || o > dims[axis] - 0.5) return {0, 0};
      continue;
    }
    const double a = (-0.5 - o) / d, b = (dims[axis] - 0.5 - o) / d;
    enter = std::max(enter, std::min(a, b));
    exit = std::min(exit, std::max(a, b));
  }
  return {float(enter), float(exit)};
}

TEST(CellWalk, VisitsTheCellsOfARayWithoutGapsAndEndsWithIt) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const glm::ivec3 dims : {glm::ivec3(13, 7, 19), glm::ivec3(1, 1, 1), glm::ivec3(2, 31, 1)})
    for (const int size : {1, 3, 4, 5, 64}) {
      const MajorantView grid = gridFor(dims, size);
      for (int trial = 0; trial < 5000; ++trial) {
        Ray ray;
        for (int axis = 0; axis < 3; ++axis) {
          // Often exactly on a face of voxels, cells or the box, and often with a zero component.
          const float where = (uniform(random) * 0.5f + 0.5f) * float(dims[axis]) - 0.5f;
          const auto kind = random() % 4;
          ray.origin[axis] = kind == 0   ? std::floor(where)
                             : kind == 1 ? (random() % 2 ? -0.5f : float(dims[axis]) - 0.5f)
                                         : where;
          ray.direction[axis] = random() % 3 == 0 ? 0.0f : random() % 3 == 0 ? 1.0f : uniform(random);
        }
        if (ray.direction == glm::vec3(0)) continue;
        ray.origin -= ray.direction * float(random() % 3) * 32.0f;  // exact for direction 1
        const Interval inside = clipToVolume(ray, dims), exact = clipInDouble(ray, dims);
        if (exact.exit - exact.enter > 1e-3f) {  // else rounding decides
          ASSERT_NEAR(inside.enter, exact.enter, 1e-4f + exact.enter * 1e-5f);
          ASSERT_NEAR(inside.exit, exact.exit, 1e-4f + exact.exit * 1e-5f);
        }
        if (!(inside.enter < inside.exit)) continue;
        CellWalk walk(ray, inside, grid);
        ASSERT_EQ(walk.enter(), inside.enter);
        for (int step = 0;; ++step) {
          ASSERT_LE(step, longestWalk(grid));
          ASSERT_LT(walk.index(), cellCount(grid));
          ASSERT_LE(walk.enter(), walk.exit());
          // pointAt() moves a point of the piece by no more than rounding.
          const float t = 0.5f * (walk.enter() + walk.exit());
          const glm::vec3 p = ray.origin + t * ray.direction, q = walk.pointAt(t);
          for (int axis = 0; axis < 3; ++axis)
            ASSERT_NEAR(p[axis], q[axis], 2e-5f * (1 + std::abs(ray.origin[axis]))) << "size " << size;
          const float left = walk.exit();
          if (!walk.advance()) {
            ASSERT_EQ(left, inside.exit);
            break;
          }
          ASSERT_EQ(walk.enter(), left);
        }
      }
    }
}

TEST(CellWalk, CountsTheFacesOfTheBoxAsInsideAndNothingBeside) {
  const glm::ivec3 dims(6, 4, 9);
  const auto lengthAt = [&](glm::vec3 origin, glm::vec3 direction) {
    const Interval inside = clipToVolume({origin, direction}, dims);
    return inside.enter < inside.exit ? inside.exit - inside.enter : 0.0f;
  };
  for (const float x : {-0.5f, 0.0f, 2.0f, 5.5f})
    for (const float y : {-0.5f, 1.0f, 3.5f}) {
      EXPECT_EQ(lengthAt({x, y, -8}, {0, 0, 1}), 9);
      EXPECT_EQ(lengthAt({x, y, -8}, {-0.0f, 0, 1}), 9);
      EXPECT_EQ(lengthAt({x, y, 20}, {0, -0.0f, -1}), 9);
      EXPECT_EQ(lengthAt({x, y, -8}, {0, 0, -1}), 0);
      EXPECT_EQ(lengthAt({x, y, 2.5f}, {0, 0, -1}), 3);  // from inside
      EXPECT_EQ(lengthAt({x, y, 2.5f}, {0, 0, 1}), 6);
    }
  for (const float x : {std::nextafter(-0.5f, -1.0f), std::nextafter(5.5f, 6.0f)})
    EXPECT_EQ(lengthAt({x, 1, -8}, {0, 0, 1}), 0);
  EXPECT_EQ(lengthAt({-0.5f, -0.5f, -0.5f}, {-1, -1, -1}), 0);  // in a corner, looking out
  EXPECT_EQ(lengthAt({-0.5f, -0.5f, -0.5f}, {1, 1, 1}), 4);     // and in
  EXPECT_EQ(lengthAt({2, 2, 2}, {0, 0, 0}), 0);
}

TEST(CellWalk, TakesADenormalDirectionForNone) {
  // 1 / direction is infinite and, on the plane between two cells, its product with 0 is NaN.
  const glm::ivec3 dims(9, 9, 9);
  const MajorantView grid = gridFor(dims, 4);
  for (int axis = 0; axis < 3; ++axis)
    for (const float tiny : {kDenormal, -kDenormal, 1e-39f, -1e-39f})
      for (int along = 0; along < 3; ++along) {
        if (along == axis) continue;
        Ray ray{glm::vec3(4), glm::vec3(0)};
        ray.origin[along] = -3;
        ray.direction[along] = 1;
        ray.direction[axis] = tiny;
        const Interval inside = clipToVolume(ray, dims);
        ASSERT_EQ(inside.enter, 2.5f);
        ASSERT_EQ(inside.exit, 11.5f);
        CellWalk walk(ray, inside, grid);
        std::vector<float> ends;
        do
          if (walk.exit() > walk.enter()) ends.push_back(walk.exit());
        while (walk.advance());
        EXPECT_EQ(ends, (std::vector<float>{7, 11.5f})) << axis << along << tiny;
      }
}

TEST(CellWalk, OfRaysWithoutSenseIsBoundedAndSeesNothingWhereTheyAreNotFinite) {
  const float values[] = {0.0f, -0.0f,     0.3f,       -0.3f,  1.0f,  -1.0f,    2.0f,
                          4.0f, kDenormal, -kDenormal, 1e-39f, 1e30f, kLargest, -kLargest,
                          kNaN, kInfinity, -kInfinity, 1e-30f, 5.5f,  -0.5f,    -1e-39f};
  std::mt19937 random(2);
  const glm::ivec3 dims(6, 5, 9);
  for (const int size : {1, 2, 4}) {
    const MajorantView grid = gridFor(dims, size);
    for (int trial = 0; trial < 400'000; ++trial) {
      Ray ray;
      bool finite = true;
      for (int i = 0; i < 6; ++i) {
        float& component = i < 3 ? ray.origin[i] : ray.direction[i - 3];
        component = values[random() % std::size(values)];
        finite = finite && isFinite(component);
      }
      const Interval inside = clipToVolume(ray, dims);
      ASSERT_TRUE(finite || !(inside.enter < inside.exit)) << trial;
      // With any interval, even one that no caller would use.
      for (const Interval interval :
           {inside, Interval{0, 10}, Interval{-kInfinity, kInfinity}, Interval{kNaN, kNaN}}) {
        CellWalk walk(ray, interval, grid);
        int steps = 0;
        do {
          ASSERT_LE(steps++, longestWalk(grid)) << trial;
          ASSERT_LT(walk.index(), cellCount(grid)) << trial;
          for (const float t : {walk.enter(), walk.exit(), kNaN}) {
            const glm::vec3 p = walk.pointAt(t);
            for (int axis = 0; axis < 3; ++axis)
              ASSERT_TRUE(p[axis] >= -0.5f && p[axis] <= float(dims[axis] + size)) << trial;
          }
        } while (walk.advance());
      }
    }
  }
}

/// Totals of a grid with some cells that are not empty, and the same totals without the distances by which a
/// walk leaps.
struct Emptiness {
  std::vector<TotalCode> leaping, plain;
  Emptiness(const MajorantView& grid, std::mt19937& random, int filled) : plain(cellCount(grid)) {
    const glm::ivec3 n = grid.cells;
    const auto blockOf = [&](std::size_t i) {
      return glm::ivec3(int(i) % n.x, int(i) / n.x % n.y, int(i) / n.x / n.y) / kBlockEdge;
    };
    std::vector<glm::ivec3> blocks;
    for (int i = 0; i < filled; ++i) {
      const std::size_t cell = random() % plain.size();
      plain[cell] = codeOfTotal(1);
      blocks.push_back(blockOf(cell));
    }
    leaping = plain;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      int radius = kMaxEmptyRadius;
      for (const glm::ivec3 block : blocks) {
        const glm::ivec3 away = glm::abs(blockOf(i) - block);
        radius = std::min(radius, std::max({away.x, away.y, away.z}));
      }
      if (radius > 0) leaping[i] = codeOfEmpty(radius);
    }
  }
};

TEST(CellWalk, LeapsOverEmptyBlocksAndVisitsWhatIsNotEmptyAsItWouldWithout) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  long plainSteps = 0, leapingSteps = 0, visited = 0;
  struct Visit {
    std::size_t cell;
    float enter, exit;
    glm::vec3 middle;
    bool operator==(const Visit&) const = default;
  };
  for (const glm::ivec3 dims : {glm::ivec3(63, 50, 41), glm::ivec3(97, 2, 33), glm::ivec3(30, 31, 29)})
    for (const int size : {1, 2, 3})
      for (const int filled : {0, 5, 60}) {
        MajorantView grid = gridFor(dims, size);
        const Emptiness totals(grid, random, filled);
        for (int trial = 0; trial < 2000; ++trial) {
          Ray ray;
          for (int axis = 0; axis < 3; ++axis) {
            const float where = (uniform(random) * 0.5f + 0.5f) * float(dims[axis]) - 0.5f;
            ray.origin[axis] = random() % 3 == 0 ? std::floor(where) : where;  // often on a face of cells
            const auto kind = random() % 8;
            ray.direction[axis] = kind == 0 ? 0.0f : kind == 1 ? 1.0f : kind == 2 ? 1e-39f : uniform(random);
          }
          if (ray.direction == glm::vec3(0)) continue;
          ray.origin -= ray.direction * float(random() % 3) * 64.0f;
          const Interval inside = clipToVolume(ray, dims);
          if (!(inside.enter < inside.exit)) continue;
          const auto follow = [&](const std::vector<TotalCode>& codes, long* steps) {
            grid.totals = codes.data();
            CellWalk walk(ray, inside, grid);
            std::vector<Visit> visits;
            float last = inside.enter;
            do {
              ++*steps;
              EXPECT_EQ(walk.enter(), last);
              last = walk.exit();
              EXPECT_LE(walk.enter(), last);
              if (grid.total(walk.index()) > 0)
                visits.push_back({walk.index(), walk.enter(), last, walk.pointAt((walk.enter() + last) / 2)});
            } while (walk.advance());
            EXPECT_EQ(last, inside.exit);
            return visits;
          };
          const auto expected = follow(totals.plain, &plainSteps);
          const auto found = follow(totals.leaping, &leapingSteps);
          ASSERT_TRUE(expected == found) << "size " << size << " trial " << trial;
          visited += long(found.size());
        }
      }
  EXPECT_GT(visited, 1000);
  EXPECT_LT(leapingSteps, plainSteps / 2);
}

TEST(CellWalk, OfRaysWithoutSenseThroughEmptyBlocksIsBounded) {
  const float values[] = {0.0f,  -0.0f,     0.3f, -1.0f,     4.0f,      kDenormal,
                          1e30f, -kLargest, kNaN, kInfinity, -kInfinity};
  std::mt19937 random(4);
  const glm::ivec3 dims(23, 14, 61);
  MajorantView grid = gridFor(dims, 1);
  const Emptiness totals(grid, random, 2);
  grid.totals = totals.leaping.data();
  for (int trial = 0; trial < 100'000; ++trial) {
    Ray ray;
    for (int i = 0; i < 6; ++i)
      (i < 3 ? ray.origin[i] : ray.direction[i - 3]) = values[random() % std::size(values)];
    for (const Interval interval :
         {clipToVolume(ray, dims), Interval{0, 10}, Interval{-kInfinity, kInfinity}, Interval{kNaN, kNaN}}) {
      CellWalk walk(ray, interval, grid);
      int steps = 0;
      do {
        ASSERT_LE(steps++, longestWalk(grid)) << trial;
        ASSERT_LT(walk.index(), cellCount(grid)) << trial;
      } while (walk.advance());
    }
  }
}

}  // namespace
}  // namespace scolopax::kernel
