// SPDX-License-Identifier: Apache-2.0
// How far two pictures are apart. `compare` prints it and tests judge with it.
#pragma once
#include "renderer/data/image.h"

namespace scolopax {

/// Differences over linear premultiplied RGB (alpha is not looked at), with a peak value of 1. A component
/// that is not finite is never passed over: an infinite one makes rmse and maximum infinite, a NaN all three
/// NaN.
struct ImageDifference {
  double rmse = 0;     ///< square root of the mean squared difference over all pixels and 3 components
  double psnr = 0;     ///< -20 log10(rmse), dB; infinite for equal pictures
  double maximum = 0;  ///< largest absolute difference of one component
};

/// Throws Error(badInput) when the sizes differ or there is no pixel.
ImageDifference compareImages(const Image& a, const Image& b);

}  // namespace scolopax
