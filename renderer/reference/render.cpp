// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/render.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <string>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

/// The camera in world space.
struct View {
  glm::dvec3 eye, forward, right, up;  // right and up scaled to one pixel's step in the film plane
  bool orthographic;
  double halfWidth, halfHeight;  // pixels

  View(const Camera& camera, int width, int height)
      : eye(camera.eye),
        orthographic(camera.orthoHeight.has_value()),
        halfWidth(0.5 * width),
        halfHeight(0.5 * height) {
    const double distance = glm::length(camera.target - camera.eye);
    if (!(distance > 0) || !std::isfinite(distance))
      throw Error(ErrorCode::badInput, "reference: eye and target must be different, finite points");
    forward = (camera.target - camera.eye) / distance;
    const double upSize = std::max({std::abs(camera.up.x), std::abs(camera.up.y), std::abs(camera.up.z)});
    right = upSize > 0 ? glm::cross(forward, glm::normalize(camera.up / upSize)) : glm::dvec3(0);
    if (!(glm::length(right) > 1e-6))  // up along the view: the choice that every backend makes
      right = glm::cross(forward, std::abs(forward.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0));
    right = glm::normalize(right);
    up = glm::cross(right, forward);
    constexpr double kRadians = 3.14159265358979323846 / 180;
    const double viewHeight = orthographic ? *camera.orthoHeight : 2 * std::tan(0.5 * camera.fovY * kRadians);
    right *= viewHeight / height;
    up *= viewHeight / height;
  }

  /// (x, y) in pixels from the top left corner of the picture.
  RayResult look(const Integrator& integrator, double x, double y) const {
    const glm::dvec3 offset = (x - halfWidth) * right + (halfHeight - y) * up;
    return orthographic ? integrator.trace(eye + offset, forward) : integrator.trace(eye, forward + offset);
  }
};

/// The output function of SplitMix64.
std::uint64_t mixed(std::uint64_t z) {
  z *= 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// Number `counter`, in [0,1), of the sequence that `key` identifies.
double uniform(std::uint64_t key, std::uint64_t counter) {
  return double(mixed(key + counter) >> 11) * 0x1p-53;
}

/// The picture's size.
glm::ivec2 sizeOf(const Scene& scene, const ReferenceOptions& options) {
  if (options.samplesPerAxis < 1 || scene.width < 1 || scene.height < 1)
    throw Error(ErrorCode::badInput, "reference: samples per axis, width and height must be at least 1");
  const int every = options.every;
  if (every < 1 || scene.width % every != 0 || scene.height % every != 0)
    throw Error(ErrorCode::badInput, "reference: every: expected a divisor of the width " +
                                         std::to_string(scene.width) + " and the height " +
                                         std::to_string(scene.height) + ", found " + std::to_string(every));
  if (options.tolerance && !(*options.tolerance > 0 && *options.tolerance < 1))
    throw Error(ErrorCode::badInput, "reference: the tolerance must be above 0 and below 1");
  return {scene.width / every, scene.height / every};
}

Integrator integratorOf(const Volume& volume, const Scene& scene, const ReferenceOptions& options) {
  return options.tolerance ? Integrator(volume, scene, *options.tolerance) : Integrator(volume, scene);
}

/// One pixel with the box filter.
struct BoxPixel {
  glm::vec4 mean, standardError;
  double rayError = 0;  ///< the largest of its rays
};

/// `left`, `top`: its corner. Its rays have the numbers from `firstRay` on.
BoxPixel boxPixel(const View& view, const Integrator& integrator, double left, double top, int n,
                  std::uint64_t key, std::uint64_t firstRay) {
  // Two independent points per stratum: the variance of their mean is a quarter of the squared difference.
  BoxPixel result;
  glm::dvec4 sum(0), variance(0);
  for (int stratum = 0; stratum < n * n; ++stratum) {
    const int column = stratum % n, line = stratum / n;
    glm::dvec4 rgba[2];
    for (std::uint64_t which = 0; which < 2; ++which) {
      const std::uint64_t ray = firstRay + std::uint64_t(stratum) * 2 + which;
      const RayResult found = view.look(integrator, left + (column + uniform(key, 2 * ray)) / n,
                                        top + (line + uniform(key, 2 * ray + 1)) / n);
      rgba[which] = found.rgba;
      result.rayError = std::max(result.rayError, found.error);
    }
    sum += 0.5 * (rgba[0] + rgba[1]);
    variance += 0.25 * (rgba[0] - rgba[1]) * (rgba[0] - rgba[1]);
  }
  result.mean = glm::vec4(sum / double(n * n));
  result.standardError = glm::vec4(glm::sqrt(variance) / double(n * n));
  return result;
}

}  // namespace

ReferenceImage renderReference(const Volume& volume, const Scene& scene, const ReferenceOptions& options) {
  const glm::ivec2 size = sizeOf(scene, options);
  const Integrator integrator = integratorOf(volume, scene, options);
  const View view(scene.camera, scene.width, scene.height);
  const std::size_t count = std::size_t(size.x) * std::size_t(size.y);
  const int n = options.samplesPerAxis;
  ReferenceImage result;
  result.image = {size.x, size.y, std::vector<glm::vec4>(count)};
  result.standardError.assign(count, glm::vec4(0));
  std::vector<double> rayErrors(count);
  const std::uint64_t key = mixed(options.seed + 1);

  tbb::parallel_for(std::size_t(0), count, [&](std::size_t pixel) {
    const std::size_t row = pixel / std::size_t(size.x), column = pixel % std::size_t(size.x);
    const double left = double(column) * options.every + options.every / 2;
    const double top = double(row) * options.every + options.every / 2;
    if (scene.filter == PixelFilter::point) {
      const RayResult ray = view.look(integrator, left + 0.5, top + 0.5);
      result.image.pixels[pixel] = glm::vec4(ray.rgba);
      rayErrors[pixel] = ray.error;
      return;
    }
    const BoxPixel box = boxPixel(view, integrator, left, top, n, key, pixel * std::uint64_t(n * n) * 2);
    result.image.pixels[pixel] = box.mean;
    result.standardError[pixel] = box.standardError;
    rayErrors[pixel] = box.rayError;
  });
  result.maximumRayError = *std::max_element(rayErrors.begin(), rayErrors.end());
  return result;
}

}  // namespace scolopax::reference
