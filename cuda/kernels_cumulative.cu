// SPDX-License-Identifier: Apache-2.0
#include "cuda/pixel_kernels.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/trackers/one_process.h"

namespace scolopax::cuda {

template LaunchFunction chooseLaunch<kernel::Analog<kernel::Cumulative>>(const Scene&, bool);

}  // namespace scolopax::cuda
