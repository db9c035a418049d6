// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/crossings.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

namespace scolopax::reference {
namespace {

// In voxels. Where a ray meets an edge of voxels, rounding may put a very short part of it into a voxel that
// it does not enter.
constexpr double kLeastOfVoxel = 1e-9;

/// Follows one scalar along a ray, and notes where it crosses a value.
class Side {
 public:
  Side(const ActiveChannel& channel, const Surface& surface) : channel_(channel), surface_(surface) {}

  /// Adds the crossings in a part of the ray from t = begin to end. Between two points at which the scalar
  /// has the value it is on one side, which its middle tells.
  void follow(const ScalarAlong& scalar, double begin, double end, std::vector<Crossing>& crossings) {
    ends_ = {0, 1};
    scalar.appendCrossings(surface_.value, ends_);
    std::sort(ends_.begin(), ends_.end());
    for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
      if (!(ends_[i] < ends_[i + 1])) continue;
      const bool inside = scalar(0.5 * (ends_[i] + ends_[i + 1])) >= surface_.value;
      if (last_ && *last_ != inside)
        crossings.push_back({std::lerp(begin, end, ends_[i]), &channel_, &surface_});
      last_ = inside;
    }
  }
  /// The scalar has no value in the next part.
  void lose() { last_.reset(); }

 private:
  const ActiveChannel& channel_;
  const Surface& surface_;
  std::optional<bool> last_;  // whether the scalar was at least the value
  std::vector<double> ends_;
};

}  // namespace

std::vector<Crossing> crossingsOf(const RayCells& ray, const glm::ivec3& dims, const Clipping& clipping,
                                  std::span<const ActiveChannel> channels) {
  std::vector<Crossing> crossings;
  const double least = kLeastOfVoxel / glm::length(ray.direction);
  for (const ActiveChannel& channel : channels) {
    std::vector<Side> sides;
    for (const Surface& surface : channel.surfaces) sides.emplace_back(channel, surface);
    if (sides.empty()) continue;
    const bool nearest = channel.field.interpolation() == Interpolation::nearest;
    for (std::size_t i = 0; i + 1 < ray.cuts.size(); ++i) {
      const double begin = ray.cuts[i], end = ray.cuts[i + 1];
      if (!(begin < end) || (nearest && end - begin < least)) continue;
      const CellOnRay part(ray, begin, end, dims);
      const bool kept = clipping.keeps(channel.number, part.middle);
      const auto scalar = kept ? scalarAlong(channel.field, part) : std::nullopt;
      for (Side& side : sides) {
        if (scalar)
          side.follow(*scalar, begin, end, crossings);
        else
          side.lose();
      }
    }
  }
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.t < b.t; });
  return crossings;
}

}  // namespace scolopax::reference
