// SPDX-License-Identifier: Apache-2.0
#include "cuda/pixel_kernels.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax::cuda {

template LaunchFunction chooseLaunch<kernel::Analog<kernel::SyncDda>>(const Scene&, bool);

}  // namespace scolopax::cuda
