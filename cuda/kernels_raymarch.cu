// SPDX-License-Identifier: Apache-2.0
#include "cuda/pixel_kernels.h"
#include "renderer/kernel/raymarch.h"

namespace scolopax::cuda {

template LaunchFunction chooseLaunch<kernel::RayMarch<kernel::EqualSteps>>(const Scene&, bool);

}  // namespace scolopax::cuda
