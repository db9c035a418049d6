// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "cuda/launch.h"

namespace scolopax::test {

/// sync-dda, density, shading and shadows.
cuda::LaunchFunction oneInstance();

/// Renders a scene with that instance; returns the number of pixels that differ from the CPU's.
int differenceOfOneInstance();

}  // namespace scolopax::test
