// SPDX-License-Identifier: Apache-2.0
// A pick by the kernels of the picture: samples of single pixels, on the thread of the caller.
#pragma once
#include <memory>

#include "renderer/cpu/pass.h"
#include "renderer/data/pick.h"
#include "renderer/data/render_plan.h"

namespace scolopax {

/// `scene`: that of the plan, but for size, method, step and filter. `tiles`: its kernel without light, which
/// changes nothing of what a ray meets. Borrows the plan, which must not be updated while this is in use.
std::unique_ptr<Picking> makeCpuPicking(const RenderPlan& plan, const Scene& scene, const PixelArea& area,
                                        TileFunction tiles);

}  // namespace scolopax
