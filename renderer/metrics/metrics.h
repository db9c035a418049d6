// SPDX-License-Identifier: Apache-2.0
// How far two pictures are apart, in numbers. `compare` prints them and tests judge with them.
#pragma once
#include "renderer/data/image.h"

namespace scolopax {

/// Squared relative errors are (a - b)^2 / (b^2 + this): what is darker than a tenth counts less.
inline constexpr double kRelativeEpsilon = 0.01;

/// Differences over linear premultiplied RGB and alpha, because the background of a picture is not known. The
/// peak value is 1. Components that are not finite are not ignored: an infinite one makes rmse, maximum and
/// relative infinite, and a NaN makes all of them NaN.
struct ImageDifference {
  double rmse = 0;      ///< square root of the mean squared difference over all pixels and 4 components
  double psnr = 0;      ///< -20 log10(rmse), dB; infinite for equal pictures
  double maximum = 0;   ///< largest absolute difference of one component
  double relative = 0;  ///< mean of (a - b)^2 / (b^2 + kRelativeEpsilon): b is the reference
};

/// Throws Error(badInput) when the sizes differ or there is no pixel.
ImageDifference compareImages(const Image& a, const Image& b);

/// Throws Error(badInput) when the sizes differ or there is no pixel.
void checkComparable(const Image& a, const Image& b);

}  // namespace scolopax
