// SPDX-License-Identifier: Apache-2.0
// How a picture at rest, noisy at first, takes over from the small one that was shown while edits arrived:
// mixed in the proportion of least error, so that no picture looks worse than the one before. Between
// Film's image and the encoder.
#pragma once
#include "renderer/data/image.h"

namespace scolopax::server {

/// The same view at another size: same centre and vertical angle; linear between the centres of pixels,
/// constant beyond the outer ones.
Image enlarged(const Image& image, int width, int height);

/// Mixes `before`, of the same size, into `image` and returns the share that `image` has in it, in [0, 1].
/// The errors of the two are taken to be independent: their squares add up to the mean squared difference, so
/// with `error`, the RMSE of `image`, that of `before` is known as well, and with it the proportion of least
/// error.
double mixIn(const Image& before, double error, Image* image);

}  // namespace scolopax::server
