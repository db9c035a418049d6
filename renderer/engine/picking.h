// SPDX-License-Identifier: Apache-2.0
// A pick by the kernels of the picture: samples of single pixels, on the thread of the caller.
#pragma once
#include <memory>

#include "renderer/data/pick.h"
#include "renderer/data/render_plan.h"
#include "renderer/launcher.h"

namespace scolopax {

/// `scene`: that of the plan, but for size, method, step and filter. Borrows the launcher.
std::unique_ptr<Picking> makePicking(Launcher& launcher, std::shared_ptr<const RenderPlan> plan,
                                     const Scene& scene, const PixelArea& area);

}  // namespace scolopax
