// SPDX-License-Identifier: Apache-2.0
// One instance of the kernels, for intentionally wrong builds.
#define SCOLOPAX_PLAIN_SCENES
#include "tests/cuda/controls/one_instance.h"

#include "cuda/pixel_kernels.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax::test {

cuda::LaunchFunction oneInstance() {
  return cuda::launch<kernel::Analog<kernel::SyncDda>, kernel::BlendDensity, kernel::Lit,
                      kernel::PlainSceneView>;
}

}  // namespace scolopax::test
