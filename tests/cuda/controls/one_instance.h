// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "cuda/launch.h"

namespace scolopax::test {

/// sync-dda, density, shading and shadows.
cuda::LaunchFunction oneInstance();

/// Renders a scene that asks for that instance; returns how many of the pixels differ from the CPU's.
int differenceOfOneInstance();

}  // namespace scolopax::test
