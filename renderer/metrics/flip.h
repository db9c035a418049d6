// SPDX-License-Identifier: Apache-2.0
// LDR-FLIP: how large the difference between two pictures looks when one flips between them (Andersson et
// al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020).
#pragma once
#include <vector>

#include "renderer/data/image.h"

namespace scolopax {

/// Pixels per degree of visual angle that the paper assumes: 0.7 m from a 0.7 m wide screen of 3840 pixels.
inline constexpr double kFlipPixelsPerDegree = 67;

struct Flip {
  std::vector<float> errors;  ///< per pixel, in [0,1], top row first
  double mean = 0;
};

/// Colours are what an 8-bit picture over black would show, without its rounding: linear premultiplied RGB
/// clipped to [0,1]. A NaN in either picture makes the mean NaN, and all errors on which it has an
/// influence.
/// Throws Error(badInput) when the sizes differ or there is no pixel, or pixelsPerDegree is not in [1, 1000].
Flip flipDifference(const Image& a, const Image& b, double pixelsPerDegree = kFlipPixelsPerDegree);

/// The errors in the colours of magma: black 0, light yellow 1.
Image flipPicture(const Flip& flip, int width, int height);

}  // namespace scolopax
