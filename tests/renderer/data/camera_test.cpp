// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/support/volumes.h"

namespace scolopax {
namespace {

/// The direction and pixel axes are orthonormal in world space, so that a ray's parameter is a world length.
void expectOrthonormal(const Camera& camera) {
  const kernel::CameraRays rays = makeCameraRays(camera, test::gridOf({3, 6, 6}), 4, 4);
  EXPECT_NEAR(glm::length(rays.direction0), 1, 1e-6);
  EXPECT_NEAR(glm::dot(rays.direction0, glm::normalize(rays.directionX)), 0, 1e-6);
  EXPECT_NEAR(glm::dot(rays.direction0, glm::normalize(rays.directionY)), 0, 1e-6);
  EXPECT_NEAR(glm::dot(glm::normalize(rays.directionX), glm::normalize(rays.directionY)), 0, 1e-6);
  for (const float x : {0.5f, 3.5f}) EXPECT_NEAR(glm::length(rays(x, x).direction), 1, 1e-6) << x;
}

// The cross product of vectors that are parallel except for rounding is pure rounding error, and
// perpendicular to neither.
TEST(Camera, WhoseUpIsTheViewButForRoundingSeesWithoutDistortion) {
  Camera camera{{-6.725710453241779, 15.959062078250131, -31.561726230520883},
                {-1.164896011352539, 0.18242764472961426, 3.6595970392227173},
                {-0.14261469013567443, 0.40461336277855164, -0.9032989963564322},
                60,
                std::nullopt};
  expectOrthonormal(camera);
  const glm::dvec3 view = camera.target - camera.eye;
  for (const double scale : {1.0, -1.0, 1e-3, 3.0, 1e5}) {
    camera.up = view * scale;
    expectOrthonormal(camera);
    for (const double off : {1e-16, 1e-13, 1e-10, 1e-7, 1e-5}) {
      camera.up = view * scale + glm::dvec3(off, -off, off) * glm::length(view) * scale;
      expectOrthonormal(camera);
    }
  }
}

}  // namespace
}  // namespace scolopax
