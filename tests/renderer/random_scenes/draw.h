// SPDX-License-Identifier: Apache-2.0
// Random numbers of the scene tester: every purpose of every scene has its own sequence, so that a field
// added later changes no number of another field.
#pragma once
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace scolopax::random_scenes {

class Draw {
 public:
  /// `scene` is the scene's number; `purpose` names what is drawn.
  Draw(std::uint64_t scene, std::string_view purpose) : state_(mixed(scene + 1)) {
    for (const char c : purpose) state_ = mixed(state_ ^ std::uint64_t(static_cast<unsigned char>(c)));
  }

  std::uint64_t bits() { return mixed(state_++); }
  /// In [0, 1).
  double uniform() { return double(bits() >> 11) * 0x1p-53; }
  double between(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  /// Uniform in the logarithm; both ends above 0.
  double decades(double lo, double hi) { return lo * std::pow(hi / lo, uniform()); }
  /// From lo to hi, both included.
  int integer(int lo, int hi) { return lo + int(bits() % std::uint64_t(hi - lo + 1)); }
  bool chance(double p) { return uniform() < p; }
  template <class T>
  T oneOf(const std::vector<T>& list) {
    return list[std::size_t(bits() % list.size())];
  }
  glm::dvec3 vector(double lo, double hi) { return {between(lo, hi), between(lo, hi), between(lo, hi)}; }
  /// Of length 1; sometimes along an axis.
  glm::dvec3 direction() {
    if (chance(0.15)) {
      glm::dvec3 axis(0);
      axis[integer(0, 2)] = chance(0.5) ? 1 : -1;
      return axis;
    }
    for (;;) {
      const glm::dvec3 v = vector(-1, 1);
      const double length = glm::length(v);
      if (length > 0.1 && length < 1) return v / length;
    }
  }
  std::string hexColor() {
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text = "#";
    for (int c = 0; c < 3; ++c) {
      const int value = chance(0.3) ? 255 * integer(0, 1) : integer(0, 255);
      text += kDigits[value / 16];
      text += kDigits[value % 16];
    }
    return text;
  }

 private:
  /// The output function of SplitMix64.
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace scolopax::random_scenes
