// SPDX-License-Identifier: Apache-2.0
// Preintegrated classification (Engel et al. 2001), for the comparison that Knoll et al. 2009 make.
#pragma once
#include <algorithm>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "renderer/kernel/classify.h"

namespace scolopax::peaks {

/// Means of extinction and colour over all values between those at the front and the back of a segment, in a
/// table of size x size entries. The scalar is assumed to be linear along the segment, and absorption within
/// the segment is ignored when colours are averaged, so the table is valid for segments of any length.
/// Entries come from exact integrals of the curves, and a look-up interpolates between four of them, as
/// texture units do: the best that a table of this size can be.
class PreintegratedTable {
 public:
  struct Mean {
    glm::vec3 color;
    float extinction;  ///< per world unit
  };

  PreintegratedTable(const kernel::ChannelView& channel, int size) : size_(size) {
    const std::vector<glm::dvec4> integrals = integralsOf(channel, size);
    for (int front = 0; front < size; ++front)
      for (int back = 0; back < size; ++back)
        entries_.push_back(front == back
                               ? valueAt(channel, positionOf(front))
                               : glm::vec4((integrals[std::size_t(back)] - integrals[std::size_t(front)]) /
                                           (positionOf(back) - positionOf(front))));
  }

  /// Between two positions on the curves.
  Mean between(float front, float back) const {
    const Place f = placeOf(front), b = placeOf(back);
    const glm::vec4* row = entries_.data() + f.index * std::size_t(size_) + b.index;
    const glm::vec4 first = row[0] + b.weight * (row[1] - row[0]);
    row += size_;
    const glm::vec4 second = row[0] + b.weight * (row[1] - row[0]);
    const glm::vec4 mean = first + f.weight * (second - first);
    return {mean.w > 0 ? glm::vec3(mean) / mean.w : glm::vec3(0), mean.w};
  }

 private:
  struct Place {
    std::size_t index;
    float weight;
  };
  Place placeOf(float position) const {
    const float at = kernel::clamp(position, 0.0f, 1.0f) * float(size_ - 1);
    const int index = std::min(int(at), size_ - 2);
    return {std::size_t(index), at - float(index)};
  }
  double positionOf(int i) const { return double(i) / (size_ - 1); }

  /// (Colour x extinction, extinction) at a position.
  static glm::vec4 valueAt(const kernel::ChannelView& channel, double position) {
    const float p = float(position);
    return glm::vec4(kernel::evaluate(channel.color, p), 1) * kernel::extinctionAt(channel, p);
  }
  /// Integral of the same from knot a to a position before knot b. Simpson's rule is exact for a product of
  /// two linear functions.
  static glm::dvec4 integralOf(const kernel::OpticalKnot& a, const kernel::OpticalKnot& b, double position) {
    const double length = position - double(a.position), whole = double(b.position) - double(a.position);
    if (!(length > 0)) return glm::dvec4(0);
    const auto value = [&](double w) {
      const glm::dvec3 color = glm::dvec3(a.color) + w * glm::dvec3(b.color - a.color);
      return glm::dvec4(color, 1) * (double(a.opacity) + w * double(b.opacity - a.opacity));
    };
    const double end = length / whole;
    return (value(0) + 4.0 * value(0.5 * end) + value(end)) * (length / 6);
  }
  /// Integrals from position 0 to the position of every entry.
  std::vector<glm::dvec4> integralsOf(const kernel::ChannelView& channel, int size) const {
    const std::span knots(channel.optical.knots, std::size_t(channel.optical.count));
    std::vector<glm::dvec4> integrals;
    glm::dvec4 before(0);  // up to knot k
    std::size_t k = 0;
    for (int i = 0; i < size; ++i) {
      const double p = positionOf(i);
      for (; k + 2 < knots.size() && double(knots[k + 1].position) <= p; ++k)
        before += integralOf(knots[k], knots[k + 1], double(knots[k + 1].position));
      integrals.push_back((before + integralOf(knots[k], knots[k + 1], p)) * double(channel.density));
    }
    return integrals;
  }

  int size_;
  std::vector<glm::vec4> entries_;
};

}  // namespace scolopax::peaks
