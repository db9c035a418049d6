// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/field_view.h"

#include "renderer/kernel/filters.h"

namespace scolopax {
namespace {

static_assert(int(Interpolation::trilinear) == int(kernel::Filter::trilinear) &&
              int(Interpolation::cubic) == int(kernel::Filter::cubic) &&
              int(Interpolation::nearest) == int(kernel::Filter::nearest));

constexpr std::uint8_t kSplineFetches = 8;  // it reads 64 voxels, trilinear interpolation eight

}  // namespace

kernel::FieldView fieldView(const Channel& channel, Interpolation interpolation) {
  return {channel.voxels.base(),
          channel.voxels.type(),
          kernel::Filter(interpolation),
          interpolation == Interpolation::cubic ? kSplineFetches : std::uint8_t(1),
          channel.histogram.nonFiniteCount == 0,
          int(channel.voxels.lane()),
          int(channel.voxels.stride())};
}

float sampleStored(const Channel& channel, const glm::ivec3& dims, const glm::dvec3& point,
                   Interpolation interpolation) {
  return kernel::sampleStored<kernel::One>(fieldView(channel, interpolation), dims, glm::vec3(point));
}

}  // namespace scolopax
