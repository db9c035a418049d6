// SPDX-License-Identifier: Apache-2.0
// Blends the picture at rest, which is noisy at first, with the reduced picture that was shown while edits
// arrived. The weights minimise the error, so that no picture looks worse than the previous one. Used between
// the film and the encoder.
#pragma once
#include "renderer/data/image.h"

namespace scolopax::server {

/// The picture at another size, with the same centre and vertical angle of view. Interpolates linearly
/// between pixel centres; constant beyond the outer ones.
Image enlarged(const Image& image, int width, int height);

/// Mixes `before`, of the same size, into `image` and returns the weight of `image` in the result, in [0, 1].
/// The errors of both pictures are assumed to be independent. Then the sum of their squares is the mean
/// squared difference of the pictures. With `error`, the RMSE of `image`, this gives the error of `before`
/// and the weights of least error.
double mixIn(const Image& before, double error, Image* image);

}  // namespace scolopax::server
