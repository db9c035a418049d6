// SPDX-License-Identifier: Apache-2.0
// Measures which layout of the voxels is fastest to sample. Prints ns per point for all channels along rays:
// planar one point at a time, planar eight points at once, channels interleaved with one vector over
// channels, planar in bricks of 8^3; and for one channel out of many, which is how a tracker that draws a
// channel fetches. bench_layout [--json]
#include <immintrin.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/kernel/filters.h"
#include "tests/support/sample_lanes.h"

namespace {

using namespace scolopax;
using kernel::AxisWeight;
using kernel::axisWeight;
using kernel::lerp;

constexpr int kSide = 256, kPoints = 8;
constexpr std::size_t kVoxels = std::size_t(kSide) * kSide * kSide;

/// Offset of a voxel in bricks of 8^3.
std::size_t brickX(int x) { return std::size_t(x >> 3) * 512 + std::size_t(x & 7); }
std::size_t brickY(int y) { return std::size_t(y >> 3) * 512 * (kSide / 8) + std::size_t(y & 7) * 8; }
std::size_t brickZ(int z) {
  return std::size_t(z >> 3) * 512 * (kSide / 8) * (kSide / 8) + std::size_t(z & 7) * 64;
}

template <class T>
float bricked(const T* v, glm::vec3 p) {
  const auto axis = [](float at, auto offset) {
    const float inside = std::clamp(at, 0.0f, float(kSide - 1));
    const int whole = std::min(int(inside), kSide - 2);
    return AxisWeight{offset(whole), offset(whole + 1), inside - float(whole)};
  };
  return kernel::trilinear(v, axis(p.x, brickX), axis(p.y, brickY), axis(p.z, brickZ));
}

/// Four channels at a voxel as floats.
__attribute__((target("avx2"), always_inline)) inline __m128 load4(const std::uint8_t* v) {
  std::int32_t bits;
  std::memcpy(&bits, v, 4);
  return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(bits)));
}
__attribute__((target("avx2"), always_inline)) inline __m128 load4(const std::uint16_t* v) {
  return _mm_cvtepi32_ps(_mm_cvtepu16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(v))));
}
__attribute__((target("avx2"), always_inline)) inline __m128 load4(const float* v) { return _mm_loadu_ps(v); }

template <class T>
__attribute__((target("avx2"))) void interleaved(const T* v, int channels, glm::vec3 p, float* values) {
  const auto stride = std::size_t(channels);
  const AxisWeight x = axisWeight(p.x, kSide, stride), y = axisWeight(p.y, kSide, stride * kSide),
                   z = axisWeight(p.z, kSide, stride * kSide * kSide);
  for (int n = 0; n < channels; n += 4) {
    const auto along = [&](std::size_t row) __attribute__((target("avx2"), always_inline)) {
      const __m128 a = load4(v + row + x.low + n), b = load4(v + row + x.high + n);
      return _mm_add_ps(a, _mm_mul_ps(_mm_set1_ps(x.t), _mm_sub_ps(b, a)));
    };
    const auto mix = [](__m128 a, __m128 b, float t) __attribute__((target("avx2"), always_inline)) {
      return _mm_add_ps(a, _mm_mul_ps(_mm_set1_ps(t), _mm_sub_ps(b, a)));
    };
    _mm_storeu_ps(values + n, mix(mix(along(y.low + z.low), along(y.high + z.low), y.t),
                                  mix(along(y.low + z.high), along(y.high + z.high), y.t), z.t));
  }
}

struct Line {
  glm::vec3 origin, step;
};

/// Lines of points half a voxel apart; neighbouring lines are like the rays of a picture's rows.
std::vector<Line> linesAlong(glm::vec3 direction) {
  std::vector<Line> lines;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> jitter(0, 0.5f);
  const glm::vec3 step = glm::normalize(direction) * 0.5f;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x) {
      const glm::vec3 across = glm::normalize(glm::cross(direction, glm::vec3(0.3f, 1, 0.2f)));
      const glm::vec3 up = glm::normalize(glm::cross(across, direction));
      const glm::vec3 centre = glm::vec3(kSide * 0.5f) + across * (float(x) - 24) + up * (float(y) - 24);
      lines.push_back({centre - step * (160.0f + jitter(random)), step});
    }
  return lines;
}

double nsPerPoint(const std::vector<Line>& lines, const std::function<float(const Line&, int)>& sample) {
  constexpr int kSteps = 320;
  std::vector<double> times;
  volatile float kept = 0;
  for (int repetition = 0; repetition < 5; ++repetition) {
    const auto begin = std::chrono::steady_clock::now();
    float sum = 0;
    for (const Line& line : lines)
      for (int k = 0; k < kSteps; k += kPoints) sum += sample(line, k);
    kept = kept + sum;
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2] / (double(lines.size()) * kSteps);
}

bool furtherRow = false;  // whether a row of the JSON has been printed

template <class T>
void measure(const char* type, ScalarType scalar, int channels, bool json) {
  std::vector<VoxelBuffer> planes;
  std::vector<kernel::ChannelView> views;
  std::vector<T> mixed(kVoxels * std::size_t(channels) + 16), bricks(kVoxels);
  std::mt19937 random(1);
  for (int n = 0; n < channels; ++n) {
    VoxelBuffer& plane = planes.emplace_back(scalar, kVoxels);
    const auto voxels = plane.as<T>();
    for (std::size_t i = 0; i < kVoxels; ++i) voxels[i] = T(random() & 255);
    for (std::size_t i = 0; i < kVoxels; ++i) mixed[i * std::size_t(channels) + std::size_t(n)] = voxels[i];
    kernel::ChannelView view{};
    view.field.voxels = plane.data();
    view.field.type = scalar;
    view.field.stride = 1;
    views.push_back(view);
  }
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        bricks[brickX(x) + brickY(y) + brickZ(z)] =
            planes[0].as<T>()[(std::size_t(z) * kSide + std::size_t(y)) * kSide + std::size_t(x)];
  const glm::ivec3 dims(kSide);
  const auto at = [](const Line& line, int k) { return line.origin + float(k) * line.step; };
  const auto perPoint = [&](auto&& one) {
    return [&, one](const Line& line, int k) {
      float sum = 0;
      for (int i = 0; i < kPoints; ++i) sum += one(at(line, k + i));
      return sum;
    };
  };
  kernel::SceneView scene{};
  scene.dims = dims;
  scene.channels = views.data();
  scene.channelCount = channels;
  const test::SampleLanes together8 = test::avx2LaneSampler().sample;
  for (const auto& [name, direction] :
       {std::pair{"x", glm::vec3(1, 0.02f, 0.01f)}, std::pair{"z", glm::vec3(0.01f, 0.02f, 1)},
        std::pair{"oblique", glm::vec3(1, 0.8f, 1.2f)}}) {
    const auto lines = linesAlong(direction);
    const double planar = nsPerPoint(lines, perPoint([&](glm::vec3 p) {
                                       float sum = 0;
                                       for (const auto& view : views)
                                         sum += kernel::sampleStored<kernel::One>(view.field, dims, p);
                                       return sum;
                                     }));
    const double together = nsPerPoint(lines, [&](const Line& line, int k) {
      glm::vec3 points[kPoints];
      float values[kernel::kMaxVisibleChannels][test::kMostLanes], sum = 0;
      for (int i = 0; i < kPoints; ++i) points[i] = at(line, k + i);
      together8(scene, (1u << channels) - 1, points, values);
      for (int n = 0; n < channels; ++n)
        for (int i = 0; i < kPoints; ++i) sum += values[n][i];
      return sum;
    });
    const double interleave = channels % 4 ? 0 : nsPerPoint(lines, perPoint([&](glm::vec3 p) {
                                                              float values[32], sum = 0;
                                                              interleaved(mixed.data(), channels, p, values);
                                                              for (int n = 0; n < channels; ++n)
                                                                sum += values[n];
                                                              return sum;
                                                            }));
    const double brick =
        channels == 1 ? nsPerPoint(lines, perPoint([&](glm::vec3 p) { return bricked(bricks.data(), p); }))
                      : 0;
    int turn = 0;
    const double one =
        nsPerPoint(lines, perPoint([&](glm::vec3 p) {
                     turn = (turn + 1) % channels;
                     return kernel::sampleStored<kernel::One>(views[std::size_t(turn)].field, dims, p);
                   }));
    const double oneInterleaved =
        nsPerPoint(lines, perPoint([&](glm::vec3 p) {
                     turn = (turn + 1) % channels;
                     const auto stride = std::size_t(channels);
                     return kernel::trilinear(mixed.data() + turn, axisWeight(p.x, kSide, stride),
                                              axisWeight(p.y, kSide, stride * kSide),
                                              axisWeight(p.z, kSide, stride * kSide * kSide));
                   }));
    if (json) {
      std::printf(
          "%s{\"type\": \"%s\", \"channels\": %d, \"rays\": \"%s\", \"planar\": %.2f, \"planar8\": %.2f, "
          "\"interleaved\": %.2f, \"bricked\": %.2f, \"onePlanar\": %.2f, \"oneInterleaved\": %.2f}",
          furtherRow ? ",\n" : "[", type, channels, name, planar, together, interleave, brick, one,
          oneInterleaved);
      furtherRow = true;
    } else {
      std::printf("%-4s %9d %8s %9.2f %9.2f %12.2f %8.2f %11.2f %16.2f\n", type, channels, name, planar,
                  together, interleave, brick, one, oneInterleaved);
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool json = argc > 1 && std::string(argv[1]) == "--json";
  if (!json)
    std::printf("%-4s %9s %8s %9s %9s %12s %8s %11s %16s\n", "type", "channels", "rays", "planar",
                "planar x8", "interleaved", "bricked", "one planar", "one interleaved");
  for (const int channels : {1, 4, 8}) {
    measure<std::uint8_t>("u8", ScalarType::u8, channels, json);
    measure<std::uint16_t>("u16", ScalarType::u16, channels, json);
    measure<float>("f32", ScalarType::f32, channels, json);
  }
  if (json) std::printf("]\n");
}
