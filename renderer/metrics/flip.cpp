// SPDX-License-Identifier: Apache-2.0
#include "renderer/metrics/flip.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/colormap.h"
#include "renderer/metrics/metrics.h"

namespace scolopax {
namespace {

// Table 1 and sections 4.1, 4.2 of the paper.
constexpr double kColorExponent = 0.7, kFeatureExponent = 0.5;  // qc, qf
constexpr double kColorKnee = 0.4, kErrorAtKnee = 0.95;         // pc, pt
constexpr double kFeatureWidth = 0.082;                         // w, degrees

/// A picture of three components per pixel.
struct Planes {
  int width, height;
  std::vector<glm::dvec3> pixels;
};

// --- Colour spaces ---------------------------------------------------------------------------------------

/// CIE XYZ from linear sRGB (D65), as ratios of integers from the primaries' chromaticities.
const glm::dmat3 kXyzFromRgb = glm::transpose(glm::dmat3(
    glm::dvec3(10135552, 8788810, 4435075) / 24577794.0, glm::dvec3(2613072, 8788810, 887015) / 12288897.0,
    glm::dvec3(1425312, 8788810, 70074185) / 73733382.0));
const glm::dmat3 kRgbFromXyz = glm::inverse(kXyzFromRgb);
const glm::dvec3 kWhite = kXyzFromRgb * glm::dvec3(1);

/// YCxCz: linear in XYZ, on which the contrast sensitivity functions act.
glm::dvec3 ycxczFromRgb(const glm::dvec3& rgb) {
  const glm::dvec3 v = kXyzFromRgb * rgb / kWhite;
  return {116 * v.y - 16, 500 * (v.x - v.y), 200 * (v.y - v.z)};
}
glm::dvec3 rgbFromYcxcz(const glm::dvec3& c) {
  const double y = (c.x + 16) / 116;
  return kRgbFromXyz * (glm::dvec3(y + c.y / 500, y, y - c.z / 200) * kWhite);
}

/// L*a*b* with the Hunt effect: colours of dark places look less colourful.
glm::dvec3 huntLabFromRgb(const glm::dvec3& rgb) {
  constexpr double kDelta = 6.0 / 29;
  const auto f = [](double t) {
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
  };
  const glm::dvec3 v = kXyzFromRgb * rgb / kWhite;
  const double lightness = 116 * f(v.y) - 16, hunt = 0.01 * lightness;
  return {lightness, hunt * 500 * (f(v.x) - f(v.y)), hunt * 200 * (f(v.y) - f(v.z))};
}

double hyab(const glm::dvec3& a, const glm::dvec3& b) {
  return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

// --- Filters ---------------------------------------------------------------------------------------------

/// One-dimensional, from -radius to radius.
using Taps = std::vector<double>;

template <class F>
Taps makeTaps(int radius, F&& weight) {
  Taps taps;
  for (int i = -radius; i <= radius; ++i) taps.push_back(weight(double(i)));
  return taps;
}

double sumOf(const Taps& taps) {
  double sum = 0;
  for (const double t : taps) sum += t;
  return sum;
}

/// Filters `values` along x with one row of taps and along y with another; borders are repeated.
std::vector<double> filtered(const std::vector<double>& values, int width, int height, const Taps& alongX,
                             const Taps& alongY) {
  const auto pass = [&](const std::vector<double>& in, const Taps& taps, int dx, int dy) {
    const int radius = int(taps.size() / 2);
    std::vector<double> out(in.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
          const int px = std::clamp(x + i * dx, 0, width - 1), py = std::clamp(y + i * dy, 0, height - 1);
          sum += taps[std::size_t(i + radius)] * in[std::size_t(px) + std::size_t(py) * std::size_t(width)];
        }
        out[std::size_t(x) + std::size_t(y) * std::size_t(width)] = sum;
      }
    return out;
  };
  return pass(pass(values, alongX, 1, 0), alongY, 0, 1);
}

/// One term a sqrt(pi/b) exp(-pi^2 d^2 / b) of a contrast sensitivity function, d in degrees: a Gaussian, and
/// so a product of x and y.
struct Sensitivity {
  double a, b;
};
constexpr Sensitivity kAchromatic[] = {{1, 0.0047}}, kRedGreen[] = {{1, 0.0053}},
                      kBlueYellow[] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kWidestB = 0.04;

/// Removes from one component what the eye cannot resolve at this distance.
template <std::size_t N>
void filterBySensitivity(Planes& image, int component, const Sensitivity (&terms)[N],
                         double pixelsPerDegree) {
  const int radius =
      int(std::ceil(3 * std::sqrt(kWidestB / (2 * std::numbers::pi * std::numbers::pi)) * pixelsPerDegree));
  std::vector<double> values, sum(image.pixels.size());
  for (const glm::dvec3& p : image.pixels) values.push_back(p[component]);
  double total = 0;
  for (const Sensitivity& term : terms) {
    const Taps taps = makeTaps(radius, [&](double i) {
      const double degrees = i / pixelsPerDegree;
      return std::exp(-std::numbers::pi * std::numbers::pi * degrees * degrees / term.b);
    });
    const double scale = term.a * std::sqrt(std::numbers::pi / term.b);
    total += scale * sumOf(taps) * sumOf(taps);
    const std::vector<double> part = filtered(values, image.width, image.height, taps, taps);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scale * part[i];
  }
  for (std::size_t i = 0; i < sum.size(); ++i) image.pixels[i][component] = sum[i] / total;
}

/// Positive weights add up to 1, negative ones to -1.
Taps balanced(Taps taps) {
  double positive = 0, negative = 0;
  for (const double t : taps) (t > 0 ? positive : negative) += t;
  for (double& t : taps) t /= t > 0 ? positive : -negative;
  return taps;
}

/// Lengths of the responses of a feature detector along x and along y.
std::vector<double> featuresOf(const std::vector<double>& luminance, int width, int height,
                               const Taps& across, const Taps& along) {
  const std::vector<double> x = filtered(luminance, width, height, across, along),
                            y = filtered(luminance, width, height, along, across);
  std::vector<double> lengths(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) lengths[i] = std::hypot(x[i], y[i]);
  return lengths;
}

struct Features {
  std::vector<double> edges, points;
};
Features detectFeatures(const Planes& ycxcz, double pixelsPerDegree) {
  const double deviation = 0.5 * kFeatureWidth * pixelsPerDegree;
  const int radius = int(std::ceil(3 * deviation));
  const auto gauss = [&](double i) { return std::exp(-i * i / (2 * deviation * deviation)); };
  Taps along = makeTaps(radius, gauss);
  const double sum = sumOf(along);
  for (double& t : along) t /= sum;
  const Taps edge = balanced(makeTaps(radius, [&](double i) { return -i * gauss(i); }));
  const Taps point =
      balanced(makeTaps(radius, [&](double i) { return (i * i / (deviation * deviation) - 1) * gauss(i); }));
  std::vector<double> luminance;
  for (const glm::dvec3& p : ycxcz.pixels) luminance.push_back((p.x + 16) / 116);
  return {featuresOf(luminance, ycxcz.width, ycxcz.height, edge, along),
          featuresOf(luminance, ycxcz.width, ycxcz.height, point, along)};
}

// --- The two parts of the error --------------------------------------------------------------------------

/// NaN stays NaN.
double clippedToUnit(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

Planes ycxczOf(const Image& image) {
  Planes planes{image.width, image.height, {}};
  for (const glm::vec4& p : image.pixels)
    planes.pixels.push_back(ycxczFromRgb({clippedToUnit(p.x), clippedToUnit(p.y), clippedToUnit(p.z)}));
  return planes;
}

/// The colours as the eye sees them, in Hunt-adjusted L*a*b*.
std::vector<glm::dvec3> seenColors(Planes ycxcz, double pixelsPerDegree) {
  filterBySensitivity(ycxcz, 0, kAchromatic, pixelsPerDegree);
  filterBySensitivity(ycxcz, 1, kRedGreen, pixelsPerDegree);
  filterBySensitivity(ycxcz, 2, kBlueYellow, pixelsPerDegree);
  for (glm::dvec3& p : ycxcz.pixels) {
    const glm::dvec3 rgb = rgbFromYcxcz(p);
    p = huntLabFromRgb({clippedToUnit(rgb.x), clippedToUnit(rgb.y), clippedToUnit(rgb.z)});
  }
  return ycxcz.pixels;
}

/// Maps the distance of two colours to [0,1]. The largest one, from green to blue, becomes 1; distances above
/// kColorKnee of it are compressed into the last 0.05.
double colorError(const glm::dvec3& a, const glm::dvec3& b) {
  static const double largest =
      std::pow(hyab(huntLabFromRgb({0, 1, 0}), huntLabFromRgb({0, 0, 1})), kColorExponent);
  const double difference = std::pow(hyab(a, b), kColorExponent), knee = kColorKnee * largest;
  if (difference < knee) return difference * kErrorAtKnee / knee;
  return kErrorAtKnee + (difference - knee) / (largest - knee) * (1 - kErrorAtKnee);
}

}  // namespace

Flip flipDifference(const Image& a, const Image& b, double pixelsPerDegree) {
  checkComparable(a, b);
  if (!(pixelsPerDegree >= 1 && pixelsPerDegree <= 1000))
    throw Error(ErrorCode::badInput,
                "flip: pixels per degree must be from 1 to 1000, found " + shortText(pixelsPerDegree));
  const Planes planesA = ycxczOf(a), planesB = ycxczOf(b);
  const Features featuresA = detectFeatures(planesA, pixelsPerDegree),
                 featuresB = detectFeatures(planesB, pixelsPerDegree);
  const std::vector<glm::dvec3> colorsA = seenColors(planesA, pixelsPerDegree),
                                colorsB = seenColors(planesB, pixelsPerDegree);
  Flip flip;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double color = colorError(colorsA[i], colorsB[i]);
    const double feature = std::max(std::abs(featuresA.edges[i] - featuresB.edges[i]),
                                    std::abs(featuresA.points[i] - featuresB.points[i]));
    const double featureError = std::pow(feature / std::sqrt(2.0), kFeatureExponent);
    const double error = std::pow(color, 1 - featureError);
    flip.errors.push_back(float(error));
    flip.mean += error;
  }
  flip.mean /= double(a.pixels.size());
  return flip;
}

Image flipPicture(const Flip& flip, int width, int height) {
  static const std::vector<ColorKnot> magma = colormapKnots("magma");
  Image picture{width, height, {}};
  for (const float error : flip.errors) {
    // NaN is shown as the largest error.
    const double at = (error >= 0 && error < 1 ? double(error) : 1.0) * double(magma.size() - 1);
    const std::size_t knot = std::min(std::size_t(at), magma.size() - 2);
    const glm::dvec3 color = glm::mix(magma[knot].color, magma[knot + 1].color, at - double(knot));
    picture.pixels.push_back(glm::vec4(glm::vec3(color), 1));
  }
  return picture;
}

}  // namespace scolopax
